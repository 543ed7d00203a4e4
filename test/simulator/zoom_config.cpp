#include "test/simulator/zoom_config.h"

#include <stdexcept>

#include "test/simulator/config_section.h"
#include "test/simulator/zoom_path.h"

namespace alidade::simulator {
namespace {

constexpr Range kShape{0.25, 4};
constexpr Range kRipple{0, 0.5};
constexpr Range kDistortion{-0.1, 0.3};
constexpr Range kSmall{0, 0.1};

void read_ends(Section& section, const char* key, Range range, ZoomConfig::Ends* ends) {
  section.section(key, [&](Section& item) {
    item.number("wide", &ends->wide, range);
    item.number("tele", &ends->tele, range);
  });
}

void optional_number(Section& section, const char* key, Range range, std::optional<double>* value) {
  double given = std::nan("");
  section.number(key, &given, range);
  if (!std::isnan(given)) *value = given;
}

void read_zoom_path(Section& section, ZoomPathConfig* path) {
  using Type = ZoomPathConfig::Type;
  section.choice<Type>("type", &path->type,
                       {{"still", Type::kStill},
                        {"dwell", Type::kDwell},
                        {"sweep", Type::kSweep},
                        {"creep", Type::kCreep},
                        {"csv", Type::kCsv}});
  optional_number(section, "zoom", kAny, &path->reading);
  section.list("stops", [&](Section& item) {
    ZoomPathConfig::Stop stop;
    optional_number(item, "zoom", kAny, &stop.reading);
    optional_number(item, "focal_length_px", kPositive, &stop.focal_length);
    item.number("rest_s", &stop.rest, kNotNegative);
    if (stop.reading.has_value() == stop.focal_length.has_value()) {
      item.fail("a stop needs zoom or focal_length_px, and only one of them");
    }
    path->stops.push_back(stop);
  });
  section.number("round_s", &path->round, kPositive);
  section.number("factor", &path->factor, kPositive);
  section.number("sweep_s", &path->duration, kPositive);
  section.number("stop_s", &path->stop, kNotNegative);
  section.number("rate_per_s", &path->rate, kPositive);
  section.path("file", &path->file);
  if ((path->type == Type::kCsv) != !path->file.empty()) {
    section.fail("path needs 'file' with 'type: csv', and only then");
  }
  if ((path->type == Type::kDwell) != !path->stops.empty()) {
    section.fail("path needs 'stops' with 'type: dwell', and only then");
  }
  if (path->round > 0 && path->type != Type::kDwell) {
    section.fail("path: round_s goes with 'type: dwell' only");
  }
}

}  // namespace

void read_zoom(Section& section, ZoomConfig* zoom) {
  read_ends(section, "focal_length_px", kPositive, &zoom->focal_length);
  section.number("shape", &zoom->shape, kShape);
  section.number("ripple", &zoom->ripple, kRipple);
  read_ends(section, "distortion", kDistortion, &zoom->distortion);
  section.pair("centre_px", &zoom->centre, 1);
  section.number("centre_wander_px", &zoom->centre_wander, kNotNegative);
  section.section("reading", [&](Section& item) {
    item.number("wide", &zoom->reading.wide);
    item.number("tele", &zoom->reading.tele);
    item.number("step", &zoom->step, kPositive);
    if (zoom->reading.wide == zoom->reading.tele) item.fail("wide and tele must differ");
  });
  section.number("sigma_rep", &zoom->sigma_rep, kSmall);
  section.number("backlash", &zoom->backlash, kSmall);
  section.number("speed_per_s", &zoom->speed, kPositive);
  section.number("acceleration_per_s2", &zoom->acceleration, kPositive);
  section.number("late_ms", &zoom->late, kNotNegative, 1e-3);
  section.list("stuck", [&](Section& item) {
    ZoomConfig::Interval interval;
    item.number("from_s", &interval.from);
    item.number("to_s", &interval.to);
    if (interval.to < interval.from) item.fail("to_s must not be before from_s");
    zoom->stuck.push_back(interval);
  });
  section.section("path", [&](Section& item) { read_zoom_path(item, &zoom->path); });
  if (zoom->focal_length.tele <= zoom->focal_length.wide) {
    section.fail("focal_length_px: tele must be more than wide");
  }
  try {
    (void)make_zoom_path(*zoom);
  } catch (const std::invalid_argument& error) {
    section.fail(error.what());
  }
}

}  // namespace alidade::simulator

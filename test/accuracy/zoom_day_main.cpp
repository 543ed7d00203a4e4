// alidade_zoom_day: what `alidade run` makes of a camera that zooms and of which it knows the data sheet alone, faster than real time
// and against truth (zoom_day.h): calibrated at two zooms, OE mode at a third between them, then movements of the zoom at random.
//   alidade_zoom_day [--seed N] [--runs N] [--movements N --minutes M] [--width 480] [--cache DIR] [--details]
// (README.md)
// Exit status: 0 OE mode holds from the first frame at the third zoom, and no record is beyond 5 sigmas; 1 that does not hold; 2 wrong
// usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "test/accuracy/endurance_consumer.h"
#include "test/accuracy/resident_memory.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/zoom_day.h"
#include "test/simulator/parallel.h"

namespace alidade::test {
namespace {

constexpr double kMostSigmas = 5;
constexpr double kZoomTolerance = 1;  // device units
constexpr double kLatestOe_s = 20;    // at the first zoom
constexpr std::size_t kBatch = 64;    // frames rendered before they are looked at
constexpr std::size_t kThird = 2;     // rest

struct Options {
  ZoomDayPlan plan;
  int runs = 1;
  double minutes = 60;
  bool details = false;
};

// Of a rest, or of the movements.
struct Tally {
  int frames = 0;
  int oe = 0;
  int pt = 0;
  int beyond = 0;  // kMostSigmas
  double worst = 0;
  std::vector<double> rms_px, log_errors;
  std::optional<double> first_oe_s;  // after the first frame
  double first_s = 0;
  bool first_is_oe = false;

  void add(double time_s, const OrientationRecord& record, const FrameErrors& errors,
           double log_error) {
    if (frames++ == 0) {
      first_s = time_s;
      first_is_oe = record.calibrated && record.mode == RecordMode::kOe;
    }
    if (!record.calibrated || !record.orientation) return;
    const double sigmas = std::max(errors.sigmas, errors.log_sigmas);
    worst = std::max(worst, sigmas);
    beyond += sigmas > kMostSigmas ? 1 : 0;
    pt += record.mode == RecordMode::kPt ? 1 : 0;
    if (record.mode != RecordMode::kOe) return;
    ++oe;
    if (!first_oe_s) first_oe_s = time_s - first_s;
    rms_px.push_back(errors.rms_px);
    log_errors.push_back(log_error);
  }
  void add(const Tally& other) {
    frames += other.frames;
    oe += other.oe;
    pt += other.pt;
    beyond += other.beyond;
    worst = std::max(worst, other.worst);
    rms_px.insert(rms_px.end(), other.rms_px.begin(), other.rms_px.end());
    log_errors.insert(log_errors.end(), other.log_errors.begin(), other.log_errors.end());
  }
  void print(const std::string& name) const {
    std::printf("  %-22s %5d frames, OE %5.1f %%, PT %5.1f %%, ", name.c_str(), frames,
                100.0 * oe / std::max(frames, 1), 100.0 * pt / std::max(frames, 1));
    if (first_oe_s) std::printf("first OE after %.2f s, ", *first_oe_s);
    if (oe > 0) {
      std::printf("rms %.3f px (worst %.2f), log f %.1e rms, ", root_mean_square(rms_px),
                  largest(rms_px), root_mean_square(log_errors));
    }
    std::printf("worst %.2f sigmas, %d beyond 5\n", worst, beyond);
  }
};

EnduranceConsumer make_consumer(const ZoomDay& day) {
  OrientationStepOptions step;
  step.video_clock.stamp_resolution_s = 1.0 / 90000;
  step.telemetry_noise.pan_tilt_sigma = day.telemetry_sigma();
  step.zoom_tolerance = kZoomTolerance;
  step.calibration = day.data_sheet();
  step.oe = oe_options(step.calibration.camera);
  step.follow_points = true;
  SelfCalibrationOptions calibrating;
  calibrating.data_sheet = step.calibration;
  calibrating.noise.pan_tilt_sigma_rad = day.telemetry_sigma();
  calibrating.zoom_tolerance = kZoomTolerance;
  calibrating.zooms = true;
  return {step, calibrating};
}

// Some frames ahead, asked for one after the other.
class Images {
 public:
  explicit Images(const ZoomDay& day) : day_(day), images_(kBatch) {}
  ImageView of(std::size_t frame) {
    if (frame % kBatch == 0) {
      const std::size_t count = std::min(kBatch, day_.frames().size() - frame);
      simulator::parallel_for(count, [&](std::size_t i) { images_[i] = day_.image(frame + i); });
    }
    return day_.camera().view(images_[frame % kBatch]);
  }

 private:
  const ZoomDay& day_;
  std::vector<std::vector<std::uint8_t>> images_;
};

// True: what must hold does.
bool run(const Options& options) {
  const ZoomDay day(options.plan);
  EnduranceConsumer consumer = make_consumer(day);
  Images images(day);
  const ZoomingCamera& camera = day.camera();
  const std::vector<ZoomDay::Rest>& rests = day.rests();
  std::printf("seed %d: f %.0f, %.0f, %.0f px of %d, %zu movements, %.0f s\n",
              static_cast<int>(options.plan.seed), rests[0].focal_length, rests[1].focal_length,
              rests[2].focal_length, options.plan.width, rests.size() - 1, rests.back().to_s);
  std::vector<Tally> at_rest(rests.size());
  Tally moving, moving_to_third;
  int rest_before = 0;
  double first_mib = 0;
  double most_mib = 0;
  for (const ZoomDay::Event& event : day.events()) {
    if (event.is_frame) {
      const Answer answer = consumer.add(day.frames()[event.index], images.of(event.index));
      const OrientationRecord& record = answer.record;
      const int k = static_cast<int>(event.index);
      const double time_s = camera.time_s(k);
      FrameErrors errors;
      double log_error = 0;
      if (record.orientation) {
        const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
        errors = errors_of(camera, k, frame);
        log_error = camera.log_error(k, frame);
      }
      const int rest = day.rest_of(event.index);
      if (rest >= 0) rest_before = rest;
      Tally& tally = rest >= 0          ? at_rest[static_cast<std::size_t>(rest)]
                     : rest_before == 1 ? moving_to_third
                                        : moving;
      tally.add(time_s, record, errors, log_error);
      const bool beyond = record.calibrated && record.orientation &&
                          std::max(errors.sigmas, errors.log_sigmas) > kMostSigmas;
      if (beyond || options.details) {
        std::printf(
            "  %8.2f s %s f %8.1f reading %6.0f %s %s, %d landmarks, rms %.3f px, %.2f sigmas, log "
            "f "
            "%.1e, %.2f sigmas\n",
            time_s, rest >= 0 ? "rests" : "moves", camera.camera().lens_at(time_s).focal_length,
            record.zoom.value_or(-1), to_string(record.mode), to_string(record.status),
            record.landmarks, errors.rms_px, errors.sigmas, log_error, errors.log_sigmas);
      }
      if (event.index % kBatch == 0) {
        most_mib = std::max(most_mib, resident_mib());
        if (time_s < rests.back().to_s / 4) first_mib = most_mib;
      }
    } else {
      consumer.add(day.samples()[event.index]);
    }
    for (const std::string& message : consumer.take_messages()) {
      if (options.details)
        std::printf("  %8.2f s: %s\n", event.host_time_s - ZoomDay::kHostEpoch, message.c_str());
    }
    std::fflush(stdout);
  }
  constexpr std::array<const char*, 3> kNames = {"first zoom", "second zoom", "third zoom"};
  for (std::size_t i = 0; i < kNames.size(); ++i) at_rest[i].print(kNames[i]);
  moving_to_third.print("moving to the third");
  Tally later;
  int begun_in_oe = 0;
  for (std::size_t i = kNames.size(); i < at_rest.size(); ++i) {
    later.add(at_rest[i]);
    begun_in_oe += at_rest[i].first_is_oe ? 1 : 0;
  }
  moving.print(rests.size() > kNames.size() ? "moving, all else" : "moving to the second");
  if (later.frames > 0) {
    later.print("at rest, later");
    std::printf("  %d of %zu rests begin in OE mode\n", begun_in_oe,
                at_rest.size() - kNames.size());
  }
  std::printf(
      "  %d calibrations taken over; resident %.0f MiB in the first quarter, %.0f at most\n",
      consumer.published(), first_mib, most_mib);
  Tally all = moving;
  all.add(moving_to_third);
  for (const Tally& tally : at_rest) all.add(tally);
  const Tally& third = at_rest[kThird];
  const bool held = third.first_is_oe && third.oe == third.frames;
  const bool in_time = at_rest[0].first_oe_s && *at_rest[0].first_oe_s <= kLatestOe_s;
  std::printf(
      "  OE in %s frames of the third zoom from its first on; first OE %s; %d records beyond 5 "
      "sigmas\n",
      held ? "all" : "NOT all", in_time ? "in time" : "LATE", all.beyond);
  std::fflush(stdout);
  return held && in_time && all.beyond == 0;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("A camera that zooms, live from its data sheet, against truth");
  alidade::test::Options options;
  alidade::test::ZoomDayPlan& plan = options.plan;
  app.add_option("--seed", plan.seed, "of everything that is drawn; of the first run");
  app.add_option("--runs", options.runs, "one seed after the other")->check(CLI::Range(1, 1000));
  app.add_option("--width", plan.width, "px, of pictures")->check(CLI::Range(320, 1920));
  app.add_option("--movements", plan.movements, "of the zoom, at random, after the third zoom")
      ->check(CLI::Range(0, 10000));
  app.add_option("--rate", plan.rate_hz, "of pictures, 1/s")->check(CLI::Range(5.0, 100.0));
  app.add_option("--minutes", options.minutes, "in which these are made")
      ->check(CLI::Range(0.1, 1000.0));
  app.add_option("--cache", plan.cache, "folder where rendered frames are kept");
  app.add_flag("--details", options.details, "the log, and a line a frame");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  plan.movements_s = 60 * options.minutes;
  bool good = true;
  for (int i = 0; i < options.runs; ++i, ++plan.seed) good = alidade::test::run(options) && good;
  return good ? 0 : 1;
}

#include "edge_app/commands/check_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "edge_app/commands/localization_json.h"
#include "edge_app/output/or_null.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

Json as_json(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"median", spread->median}, {"most", spread->most}, {"largest", spread->largest}};
}

Json as_json(const Connection& connection) {
  return {{"name", connection.name},
          {"error", connection.error.empty() ? Json() : Json(connection.error)},
          {"losses", connection.losses}};
}

Json as_json(const ClockReport& clock) {
  const char* kind = clock.kind == StampKind::kSender     ? "sender"
                     : clock.kind == StampKind::kSequence ? "sequence"
                                                          : "arrival";
  return {{"stamps", kind},
          {"usable", clock.usable},
          {"locked", clock.state == ClockState::kLocked},
          {"sigma_s", clock.sigma_s},
          {"lateness_s", as_json(clock.lateness_s)}};
}

Json as_json(const AxisReport& axis) {
  return {{"last_rad", axis.last},
          {"least_rad", axis.least},
          {"largest_rad", axis.largest},
          {"resolution_rad", axis.resolution > 0 ? Json(axis.resolution) : Json()}};
}

const char* name_of(AxisVerdict verdict) {
  switch (verdict) {
    case AxisVerdict::kNotMoved:
      return "not moved";
    case AxisVerdict::kUnclear:
      return "not clear";
    case AxisVerdict::kRight:
      return "right";
    case AxisVerdict::kReversed:
      return "reversed";
    case AxisVerdict::kNotJudged:
      return "not judged";
  }
  return "";
}

Json video_json(const CheckReport& report) {
  const VideoReport& video = report.video;
  const ImageReport& images = report.measured.images;
  const bool any = video.frames > 0;
  Json json = as_json(report.measured.video);
  json.update({{"frames", video.frames},
               {"width", any ? Json(video.width) : Json()},
               {"height", any ? Json(video.height) : Json()},
               {"size_fits", any ? Json(video.size_fits) : Json()},
               {"rate_hz", or_null(video.rate_hz)},
               {"interval_s", as_json(video.interval_s)},
               {"lost", or_null(video.lost)},
               {"damaged", video.counters.damaged},
               {"dropped", video.counters.dropped},
               {"dropped_at_start", video.at_start.dropped},
               {"unstamped", video.counters.unstamped},
               {"foreign_packets", video.counters.foreign_packets},
               {"garbage_bytes", video.counters.garbage_bytes},
               {"decode_s", as_json(video.decode_s)},
               {"clock", any ? as_json(video.clock) : Json()}});
  json["pictures"] = {{"looked_at", images.images},
                      {"mean_level", images.images > 0 ? Json(images.light.mean) : Json()},
                      {"noise_level", images.images > 0 ? Json(images.noise) : Json()},
                      {"points", images.points ? Json(images.points->median) : Json()},
                      {"while_turning", report.repeats.turning},
                      {"repeated", report.repeats.repeated},
                      {"fresh_hz", or_null(report.repeats.fresh_hz)}};
  return json;
}

Json pan_tilt_json(const CheckReport& report) {
  if (!report.has_telemetry) return nullptr;
  const TelemetryReport& telemetry = report.telemetry;
  const bool any = telemetry.samples > 0;
  Json json = as_json(report.measured.pan_tilt);
  json.update({{"samples", telemetry.samples},
               {"rate_hz", or_null(telemetry.rate_hz)},
               {"interval_s", as_json(telemetry.interval_s)},
               {"time_bounds_s", as_json(telemetry.bounds_s)},
               {"age_s", as_json(telemetry.age_s)},
               {"change_hz", or_null(telemetry.change_hz)},
               {"stale", telemetry.stale},
               {"pan", any ? as_json(telemetry.pan) : Json()},
               {"tilt", any ? as_json(telemetry.tilt) : Json()},
               {"zoom", or_null(telemetry.zoom)}});
  return json;
}

Json motion_json(const std::optional<MotionReport>& motion) {
  if (!motion) return nullptr;
  const auto by_axis = [&motion](std::size_t axis) {
    return motion->by_axis ? Json((*motion->by_axis)[axis].value_px) : Json();
  };
  return {{"pan_sign", name_of(motion->pan)},
          {"tilt_sign", name_of(motion->tilt)},
          {"image_moved", motion->image_moved},
          {"head_moved", motion->head_moved},
          {"focal_length_px", or_null(motion->focal_length_px)},
          {"focal_length_by_pan_px", by_axis(0)},
          {"focal_length_by_tilt_px", by_axis(1)},
          {"clock_offset_s", or_null(motion->clock_offset_s)}};
}

Json scene_check_json(const SceneCheck& scene) {
  if (scene.file.empty()) return nullptr;
  Json json{{"file", scene.file},
            {"error", scene.error.empty() ? Json() : Json(scene.error)},
            {"keyframes", scene.found ? Json(scene.keyframes) : Json()},
            {"landmarks", scene.found ? Json(scene.landmarks) : Json()},
            {"last", nullptr}};
  if (scene.found) {
    json["last"]["frame"] = scene.frame;
    add_localization(*scene.found, scene.mechanics, &json["last"]);
  }
  return json;
}

}  // namespace

bool is_ok(const Findings& findings) {
  return std::none_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.severity == Severity::kProblem;
  });
}

std::string check_json(const CheckReport& report) {
  const Calibration& calibration = report.calibration.calibration;
  Json json{{"alidade", ALIDADE_VERSION},
            {"ok", is_ok(report.findings)},
            {"configuration", report.configuration}};
  json["calibration"] = {{"name", report.calibration.name},
                         {"calibrated", report.calibration.calibrated},
                         {"focal_length_px", calibration.camera.focal_length},
                         {"clock_offset_s", calibration.clock_offset},
                         {"zoom", or_null(calibration.zoom)}};
  json["video"] = video_json(report);
  json["pan_tilt"] = pan_tilt_json(report);
  json["motion"] = motion_json(report.motion);
  json["scene_map"] = scene_check_json(report.scene);
  json["mqtt"] = nullptr;
  if (!report.broker.empty()) {
    json["mqtt"] = {{"name", report.broker},
                    {"error", report.broker_error.empty() ? Json() : Json(report.broker_error)}};
  }
  json["findings"] = Json::array();
  for (const Finding& finding : report.findings) {
    json["findings"].push_back(
        {{"severity", finding.severity == Severity::kProblem ? "problem" : "advice"},
         {"text", finding.text}});
  }
  // A file name need not be UTF-8.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace alidade

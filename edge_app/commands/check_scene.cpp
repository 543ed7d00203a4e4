#include "edge_app/commands/check_scene.h"

#include <fmt/format.h>

#include <cmath>

#include "core/calibration/number_text.h"
#include "core/model/nearest_angles.h"
#include "edge_app/commands/scene_loading.h"
#include "edge_app/localization/scene_search.h"

namespace alidade {
namespace {

// Camera frame, rad/s, from the shift of the picture's centre since the one before. The content
// moves left while the camera turns right. 0 if the shift is not known.
Vector3<double> angular_velocity_of(const LastPicture& last, double focal_length) {
  if (!last.shift_px_s) return Vector3<double>::Zero();
  return {last.shift_px_s->y() / focal_length, -last.shift_px_s->x() / focal_length, 0};
}

// Why a picture was not found, and what would help.
std::string why_not(const Localization& found) {
  switch (found.status) {
    case LocalizationStatus::kOk:
      break;
    case LocalizationStatus::kNotInMap:
      return "shows nothing that is in the map; point the camera at what the map holds, or add "
             "this "
             "view to it with `alidade map build --add`";
    case LocalizationStatus::kAmbiguous:
      return "fits several places of the map; point the camera at something that is there only "
             "once";
    case LocalizationStatus::kNoUsablePicture:
      return "shows too little: dark, fog, or nothing with detail; check exposure, focus and what "
             "is "
             "in view";
  }
  return "";
}

}  // namespace

SceneCheck check_scene(const Config& config, const PublishedCalibration& calibration,
                       const Measured& measured) {
  SceneCheck scene;
  // config.cpp has warned that mode PT does not use the map.
  if (!config.realtime.landmarks) return scene;
  scene.file = config.scene_map.file;
  const Camera<double>& camera = calibration.calibration.camera;
  const int width = measured.last ? measured.last->frame.width : camera.width;
  const int height = measured.last ? measured.last->frame.height : camera.height;
  if (scene.file.empty() || width == 0) return scene;
  SceneMapFile file;
  SceneMap map;
  if (!open_scene(config.scene_map, width, height, &file, &map, &scene.error)) {
    add_problem(&scene.findings, "scene map: " + scene.error);
    return scene;
  }
  if (!measured.last) return scene;
  const Frame& picture = measured.last->frame;
  scene.frame = picture.stamp.frame;
  scene.keyframes = static_cast<std::int64_t>(map.keyframes.size());
  scene.landmarks = static_cast<std::int64_t>(map.landmarks.size());
  scene.mechanics = map.mechanics.value_or(Mechanics<double>());

  LocalizationHint hint;
  const std::optional<CurveRange> range = range_of(calibration.zoom_curve);
  // With telemetry the lens may have zoomed, so its focal length is not given.
  if (!has_telemetry(config) && !range)
    hint.focal_length = focal_length_of(calibration.calibration);
  // Pixels per second give an angular velocity only if the focal length is known.
  if (has_telemetry(config) || !range) {
    hint.angular_velocity =
        angular_velocity_of(*measured.last, calibration.calibration.camera.focal_length);
  }
  if (calibration.calibration.line_delay != 0) hint.line_delay = calibration.calibration.line_delay;
  FeatureSet seen;
  scene.found = SceneSearch(map).find({picture.luma, picture.width, picture.height, picture.stride},
                                      hint, &seen);

  const std::string name = fmt::format("frame {}", scene.frame);
  if (scene.found->status != LocalizationStatus::kOk) {
    const std::string text =
        fmt::format("scene map: {}: {} {}", scene.file, name, why_not(*scene.found));
    if (has_telemetry(config)) {
      add_advice(&scene.findings, text);
    } else {
      add_problem(&scene.findings, text + "; there are no directions until a picture is found");
    }
  } else if (!has_telemetry(config)) {
    const std::string other = another_lens(*scene.found, calibration.calibration, range, name);
    if (!other.empty()) add_problem(&scene.findings, "scene map: " + other);
  }
  return scene;
}

std::string headline(const SceneCheck& scene) {
  if (!scene.error.empty()) return "failed";
  if (!scene.found) return "not tried: no picture came";
  return fmt::format("{} keyframes, {} landmarks", scene.keyframes, scene.landmarks);
}

ReportLines describe(const SceneCheck& scene) {
  if (!scene.found) return {};
  const std::string name = fmt::format("frame {}", scene.frame);
  if (scene.found->status != LocalizationStatus::kOk) {
    return {{"looks at", fmt::format("not known: {} is not localized: {}", name,
                                     to_string(scene.found->status))}};
  }
  constexpr double kDegrees = 180 / kPi;
  const PicturePose& pose = scene.found->pose;
  const PanTilt<double> angle = nearest_angles(scene.mechanics, pose.R_base_from_camera).angle;
  const auto sigma = [&pose](int i) { return std::sqrt(pose.covariance(i, i)); };
  const double f = pose.camera.focal_length;
  return {{"looks at", fmt::format("pan {} deg, tilt {} deg (sigma {} sideways, {} up and down, {} "
                                   "about the axis)",
                                   value_text(kDegrees * angle.pan, kDegrees * sigma(1)),
                                   value_text(kDegrees * angle.tilt, kDegrees * sigma(0)),
                                   sigma_text(kDegrees * sigma(1)), sigma_text(kDegrees * sigma(0)),
                                   sigma_text(kDegrees * sigma(2)))},
          {"by", fmt::format("{}, {} landmarks, focal length {}", name, scene.found->matches,
                             estimate_text(f, f * sigma(3), "px"))}};
}

}  // namespace alidade

#include "edge_app/commands/map_export.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <string_view>
#include <vector>

#include "core/calibration/number_text.h"
#include "core/mapping/map_projection.h"
#include "core/model/trigonometry.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/storage/scene_map_file.h"
#include "platform/video/jpeg_decoder.h"
#include "platform/video/picture_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

std::string keyframes_csv(const SceneMap& map) {
  std::vector<int> landmarks(map.keyframes.size(), 0);
  for (const SceneLandmark& l : map.landmarks) {
    for (const SceneSighting& s : l.sightings) {
      const auto at = keyframe_index(map, s.keyframe);
      if (at >= 0) ++landmarks[static_cast<std::size_t>(at)];
    }
  }
  std::string out =
      "keyframe,recording,frame,zoom,pan_rad,tilt_rad,q_x,q_y,q_z,q_w,focal_length_px,"
      "focal_length_sigma_px,radial_distortion,centre_u_px,centre_v_px,landmarks,residual_px\n";
  for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
    const SceneKeyframe& k = map.keyframes[i];
    const Camera<double> camera = map.camera_of(k);
    const Vector2<double> centre = camera.optical_centre();
    std::string recording = k.recording;
    // A folder's name must not split the cell.
    std::replace(recording.begin(), recording.end(), ',', '_');
    std::replace(recording.begin(), recording.end(), '\n', '_');
    std::vector<std::string> cells = {std::to_string(k.id),
                                      recording,
                                      std::to_string(k.frame),
                                      k.zoom ? exact_text(*k.zoom) : "",
                                      k.telemetry ? exact_text(k.telemetry->pan) : "",
                                      k.telemetry ? exact_text(k.telemetry->tilt) : ""};
    const Eigen::Quaterniond& q = k.R_base_from_camera;
    for (const double x : {q.x(), q.y(), q.z(), q.w(), camera.focal_length,
                           camera.focal_length * std::sqrt(k.covariance(3, 3)),
                           camera.distortion.only_term(), centre.x(), centre.y()}) {
      cells.push_back(exact_text(x));
    }
    cells.push_back(std::to_string(landmarks[i]));
    cells.push_back(exact_text(k.residual_px));
    out += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return out;
}

// An equirectangular picture in the base frame: pan to the right, elevation down. Of several
// keyframes that see a place the one with the longest focal length is shown.
struct Panorama {
  double left = 0, top = 0;  // rad; pan grows to the right, top is positive below the horizon
  double per_rad = 1;        // px/rad
  int width = 0, height = 0;
  std::vector<std::uint8_t> luma;

  [[nodiscard]] Vector3<double> direction(int column, int row) const {
    const double pan = left + (column + 0.5) / per_rad;
    const double down = top + (row + 0.5) / per_rad;
    return {std::cos(down) * std::cos(pan), std::cos(down) * std::sin(pan), std::sin(down)};
  }
};

// The angles of a direction; pan is within pi of `middle`, tilt is positive downwards.
PanTilt<double> place_of(const Vector3<double>& d, double middle) {
  const double pan = std::atan2(d.y(), d.x());
  return {middle + wrap_angle(pan - middle), std::asin(std::clamp(d.z(), -1.0, 1.0))};
}

Panorama empty_panorama(const SceneMap& map, int most_width) {
  Vector3<double> sum = Vector3<double>::Zero();
  for (const SceneKeyframe& k : map.keyframes) {
    sum += k.R_base_from_camera * Vector3<double>::UnitZ();
  }
  const double middle = std::atan2(sum.y(), sum.x());
  double left = HUGE_VAL, right = -HUGE_VAL, top = HUGE_VAL, bottom = -HUGE_VAL;
  double f_most = 0;
  for (const SceneKeyframe& k : map.keyframes) {
    const Camera<double> camera = map.camera_of(k);
    f_most = std::max(f_most, camera.focal_length);
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; j <= 8; ++j) {
        Vector3<double> d;
        if (unproject_to_map(camera, map.motion_of(k), k.R_base_from_camera.toRotationMatrix(),
                             {camera.width * i / 8.0, camera.height * j / 8.0},
                             &d) != ProjectionStatus::kOk) {
          continue;
        }
        const PanTilt<double> at = place_of(d, middle);
        left = std::min(left, at.pan);
        right = std::max(right, at.pan);
        top = std::min(top, at.tilt);
        bottom = std::max(bottom, at.tilt);
      }
    }
  }
  Panorama out;
  out.left = left;
  out.top = top;
  out.per_rad = std::min(f_most, most_width / (right - left));
  out.width = std::max(1, static_cast<int>((right - left) * out.per_rad));
  out.height = std::max(1, static_cast<int>((bottom - top) * out.per_rad));
  out.luma.assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), 0);
  return out;
}

void draw(const SceneMap& map, const SceneKeyframe& k, const Picture& picture, Panorama* out) {
  const Camera<double> camera = map.camera_of(k);
  const Matrix3<double> R = k.R_base_from_camera.toRotationMatrix();
  const PictureMotion motion = map.motion_of(k);
  const Vector3<double> axis = R.col(2);
  const double reach = std::cos(std::min(
      1.5, 1.3 * std::atan(std::hypot(camera.width, camera.height) / (2 * camera.focal_length))));
  // One pixel of the panorama is the mean of step x step pixels of the picture.
  const int step = std::max(1, static_cast<int>(std::lround(camera.focal_length / out->per_rad)));
  for (int row = 0; row < out->height; ++row) {
    for (int column = 0; column < out->width; ++column) {
      const Vector3<double> d = out->direction(column, row);
      MapProjection seen;
      if (d.dot(axis) < reach || project_from_map(camera, motion, R, camera.height / 2.0, d,
                                                  &seen) != ProjectionStatus::kOk) {
        continue;
      }
      const int left = static_cast<int>(std::floor(seen.u.x() - step / 2.0 + 0.5));
      const int top = static_cast<int>(std::floor(seen.u.y() - step / 2.0 + 0.5));
      if (left < 0 || top < 0 || left + step > picture.width || top + step > picture.height) {
        continue;
      }
      int sum = 0;
      for (int v = top; v < top + step; ++v) {
        const std::uint8_t* pixels = picture.luma + v * picture.stride;
        sum = std::accumulate(pixels + left, pixels + left + step, sum);
      }
      out->luma[static_cast<std::size_t>(row) * static_cast<std::size_t>(out->width) +
                static_cast<std::size_t>(column)] = static_cast<std::uint8_t>(sum / (step * step));
    }
  }
}

}  // namespace

int export_map(const MapExportCommand& options) {
  SceneMap map;
  std::string error;
  if (!load_scene_map(options.map, &map, &error, true)) throw CommandError(kExitUsage, error);
  if (map.keyframes.empty()) {
    throw CommandError(kExitFailed,
                       options.map + ": has no keyframes; build it with alidade map build");
  }
  OutputDirectory directory(options.directory, options.map);
  directory.add("keyframes", "keyframes.csv", keyframes_csv(map));
  OutputDirectory pictures((fs::path(options.directory) / "keyframes").string(), options.map);

  std::vector<const SceneKeyframe*> by_f;
  for (const SceneKeyframe& k : map.keyframes) by_f.push_back(&k);
  std::stable_sort(by_f.begin(), by_f.end(), [&](const auto* a, const auto* b) {
    return map.camera_of(*a).focal_length < map.camera_of(*b).focal_length;
  });
  Panorama panorama = empty_panorama(map, options.panorama_width);
  JpegDecoder decoder;
  int without = 0;
  for (const SceneKeyframe* k : by_f) {
    const std::string jpeg(k->picture.begin(), k->picture.end());
    Picture picture;
    if (jpeg.empty() || !decoder.decode(jpeg, &picture)) {
      ++without;
      continue;
    }
    pictures.add("picture", fmt::format("{:06}.jpg", k->id).c_str(), jpeg);
    draw(map, *k, picture, &panorama);
  }
  if (without > 0) spdlog::warn("{} keyframes have no picture", without);
  const std::string png =
      grey_png(panorama.luma.data(), panorama.width, panorama.height, panorama.width);
  if (png.empty()) throw CommandError(kExitFailed, "panorama.png: libav has no PNG encoder");
  directory.add("panorama", "panorama.png", png);
  for (const auto& [kind, path] : directory.files()) spdlog::info("{}: {}", kind, path);
  spdlog::info("{} pictures: {}", pictures.files().size(),
               (fs::path(options.directory) / "keyframes").string());
  return kExitOk;
}

}  // namespace alidade

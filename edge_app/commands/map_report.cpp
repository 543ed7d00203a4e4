#include "edge_app/commands/map_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/calibration/number_text.h"
#include "core/mapping/map_projection.h"
#include "core/model/median.h"
#include "core/model/trigonometry.h"

namespace alidade {
namespace {

// The keyframes of one octave of focal length.
struct Level {
  std::vector<double> f, f_sigma;  // px
  // rad, of the optical axis in the base frame, as a level mount would measure them.
  std::vector<double> pan, tilt;
  std::size_t landmarks = 0;
};

std::map<int, Level> levels_of(const SceneMap& map) {
  std::map<int, Level> out;
  const auto octave = [](double f) { return static_cast<int>(std::floor(std::log2(f))); };
  for (const SceneKeyframe& k : map.keyframes) {
    const double f = map.camera_of(k).focal_length;
    const Vector3<double> axis = k.R_base_from_camera * Vector3<double>::UnitZ();
    Level& level = out[octave(f)];
    level.f.push_back(f);
    level.f_sigma.push_back(f * std::sqrt(k.covariance(3, 3)));
    level.pan.push_back(std::atan2(axis.y(), axis.x()));
    level.tilt.push_back(-std::asin(std::clamp(axis.z(), -1.0, 1.0)));
  }
  for (const SceneLandmark& l : map.landmarks) {
    const auto level = out.find(octave(l.focal_length_px));
    if (level != out.end()) ++level->second.landmarks;
  }
  return out;
}

std::pair<double, double> extent(const std::vector<double>& x) {
  const auto [least, most] = std::minmax_element(x.begin(), x.end());
  return {*least, *most};
}

}  // namespace

double map_residual_px(const SceneMap& map) {
  double sum = 0;
  std::size_t count = 0;
  for (const SceneLandmark& l : map.landmarks) {
    if (l.sightings.size() < 2) continue;
    for (const SceneSighting& s : l.sightings) {
      const auto at = keyframe_index(map, s.keyframe);
      if (at < 0) continue;
      const SceneKeyframe& k = map.keyframes[static_cast<std::size_t>(at)];
      MapProjection seen;
      if (project_from_map(map.camera_of(k), map.motion_of(k),
                           k.R_base_from_camera.toRotationMatrix(), s.u.y(), l.d_b,
                           &seen) != ProjectionStatus::kOk) {
        continue;
      }
      sum += (seen.u - s.u).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

std::string map_text(const SceneMap& map) {
  const auto span_text = [](double least, double most) {
    return rounded_text(least, 1) + " to " + rounded_text(most, 1);
  };
  std::string out = fmt::format("{}x{} px, {} keyframes, {} landmarks\n", map.lens.width(),
                                map.lens.height(), map.keyframes.size(), map.landmarks.size());
  out += fmt::format("{:>16}  {:>9}  {:>9}  {:>16}  {:>16}  {:>9}\n", "f, px", "sigma, %",
                     "keyframes", "pan, deg", "tilt, deg", "landmarks");
  constexpr double kDegrees = 180 / kPi;
  for (const auto& [octave, level] : levels_of(map)) {
    const auto [f_least, f_most] = extent(level.f);
    const auto [pan_least, pan_most] = extent(level.pan);
    const auto [tilt_least, tilt_most] = extent(level.tilt);
    out += fmt::format("{:>16}  {:>9.2g}  {:>9}  {:>16}  {:>16}  {:>9}\n",
                       fmt::format("{:.0f} to {:.0f}", f_least, f_most),
                       100 * median(level.f_sigma) / median(level.f), level.f.size(),
                       span_text(pan_least * kDegrees, pan_most * kDegrees),
                       span_text(tilt_least * kDegrees, tilt_most * kDegrees), level.landmarks);
  }
  return out;
}

std::string map_json(const SceneMap& map, const std::string& path) {
  using nlohmann::ordered_json;
  ordered_json json;
  json["status"] = "ok";
  json["map"] = path;
  json["width"] = map.lens.width();
  json["height"] = map.lens.height();
  json["keyframes"] = map.keyframes.size();
  json["landmarks"] = map.landmarks.size();
  json["residual_px"] = map_residual_px(map);
  json["levels"] = ordered_json::array();
  for (const auto& [octave, level] : levels_of(map)) {
    const auto [f_least, f_most] = extent(level.f);
    const auto [pan_least, pan_most] = extent(level.pan);
    const auto [tilt_least, tilt_most] = extent(level.tilt);
    json["levels"].push_back({{"focal_length_px", {f_least, f_most}},
                              {"focal_length_sigma_px", median(level.f_sigma)},
                              {"keyframes", level.f.size()},
                              {"landmarks", level.landmarks},
                              {"pan_rad", {pan_least, pan_most}},
                              {"tilt_rad", {tilt_least, tilt_most}}});
  }
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace alidade

#pragma once
// SceneMap: all that a finished map is, as plain data: what is adjusted, stored, localized against and kept up.
//   keyframe   a picture that stays: where it looked when its reference row was exposed, with which f, and where that comes from
//   landmark   something that can be recognised: direction on the sphere, base; appearance; size; what became of looking for it
//   sighting   where a keyframe sees a landmark
// log f of a keyframe = s + delta(s) + eps, s its position (lens_curve.h). A landmark's error has two parts: its own, independent of other
// landmarks', and one in common with its neighbours, which no pose that was found from them can tell: as if the base were turned.
// Both stand in tangent_basis(d_b), rad^2; the error of d_b is their sum. What finds a pose takes its landmarks' own parts, and adds
// the common one to the pose.
// Keyframes and landmarks stand in increasing order of their ids, which are never given twice. Times of day outlast a restart: seconds
// of UTC since 1970. No allocation but the vectors'. Free of shared state.

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/lens_curve.h"
#include "core/mapping/map_projection.h"
#include "core/model/angle.h"
#include "core/model/mechanics.h"

namespace alidade {

struct SceneKeyframe {
  std::int64_t id = 0;  // 1 or more
  std::string recording;
  std::int64_t frame = 0;  // of the recording, from 0
  double time_utc_s = 0;
  std::optional<double> zoom;                // reading, as the lens gives it
  double position = 0;                       // s: log f by the zoom reading
  std::optional<PanTilt<double>> telemetry;  // measured angles
  Eigen::Quaterniond R_base_from_camera = Eigen::Quaterniond::Identity();
  double eps = 0;
  Matrix4<double> covariance = Matrix4<double>::Zero();        // of xi in R Exp(xi), rad, and log f
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  double residual_px = 0;             // root mean square over its sightings
  std::vector<std::uint8_t> picture;  // coded luma; may be empty
};

struct SceneSighting {
  std::int64_t keyframe = 0;  // id
  Vector2<double> u;          // px
  double scale_px = 0;        // sigma of the blob
};

struct LandmarkLife {
  double born_utc_s = 0;
  double last_seen_utc_s = 0;
  std::uint32_t looked_for = 0;  // views in which it should have been found
  std::uint32_t matched = 0;     // of those
  std::uint32_t missed = 0;      // running, up to the latest: 0 if it was found there
};

struct SceneLandmark {
  std::int64_t id = 0;  // 1 or more
  Vector3<double> d_b = Vector3<double>::UnitX();
  Matrix2<double> covariance = Matrix2<double>::Zero();         // own part
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();  // common part
  double scale_rad = 0;        // sigma of the blob, as an angle; above 0
  double focal_length_px = 0;  // at which it was seen
  Descriptor descriptor{};
  LandmarkLife life;
  std::vector<SceneSighting>
      sightings;  // by increasing keyframe, one each; none of what was born later

  [[nodiscard]] Matrix2<double> whole_covariance() const { return covariance + shared_covariance; }
};

struct SceneMap {
  // What there can be at most; with pictures that is more than a board's memory, see scene_map_file.h.
  static constexpr std::size_t kMostKeyframes = 100'000;
  static constexpr std::size_t kMostLandmarks = 1'000'000;
  static constexpr std::size_t kMostSightings = 10'000'000;
  static constexpr std::size_t kMostPictureBytes = std::size_t{16} << 20;  // of one keyframe
  static constexpr std::size_t kMostNameBytes = 4096;                      // of a recording's name
  static constexpr int kMostImageSide = 16384;                             // px
  static constexpr int kMostLensPoints = 1000;

  LensCurve lens;            // with the size of the image
  double line_delay = 0;     // s/row, any sign
  double reference_row = 0;  // px
  std::optional<Mechanics<double>> mechanics;
  std::vector<SceneKeyframe> keyframes;
  std::vector<SceneLandmark> landmarks;
  std::int64_t next_landmark = 1;  // id; above all that were ever given

  [[nodiscard]] PictureMotion motion_of(const SceneKeyframe& keyframe) const {
    return {keyframe.angular_velocity, keyframe.zoom_rate, line_delay, reference_row};
  }
  [[nodiscard]] Camera<double> camera_of(const SceneKeyframe& keyframe) const {
    return lens.camera_at(keyframe.position, keyframe.eps);
  }
};

// Index of the keyframe or landmark with this id; none: -1.
[[nodiscard]] std::ptrdiff_t keyframe_index(const SceneMap& map, std::int64_t id);
[[nodiscard]] std::ptrdiff_t landmark_index(const SceneMap& map, std::int64_t id);

// Whether every number can be what it stands for, and every id leads somewhere. error, one line, names what does not.
[[nodiscard]] bool is_valid(const SceneMap& map, std::string* error = nullptr);
// The same of one, whatever map it is to become a part of. A sighting's keyframe is not looked up.
[[nodiscard]] bool is_valid(const SceneKeyframe& keyframe, std::string* error = nullptr);
[[nodiscard]] bool is_valid(const SceneLandmark& landmark, std::string* error = nullptr);

}  // namespace alidade

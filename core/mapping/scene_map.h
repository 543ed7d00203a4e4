#pragma once
// SceneMap: a finished map as plain data, to be adjusted, stored, localized against and kept up.
//   keyframe   a picture that stays in the map: where it looked at the reference row, with which f,
//              and its origin. log f = s + delta(s) + eps (lens_curve.h), s its position.
//   landmark   a thing that can be recognised: direction in base, appearance, size, history
//   sighting   where a keyframe sees a landmark
// Ids increase, up to 2^53, and are never reused. Times are UTC seconds since 1970, up to 1e11.
// Only the vectors allocate.

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/lens_curve.h"
#include "core/mapping/picture_motion.h"
#include "core/model/angle.h"
#include "core/model/mechanics.h"

namespace alidade {

struct SceneKeyframe {
  std::int64_t id = 0;                       // 1 or more
  std::string recording;                     // name, at most kMostNameBytes
  std::int64_t frame = 0;                    // of the recording, from 0
  double time_utc_s = 0;                     // 0: not known
  std::optional<double> zoom;                // reading, in the lens's own unit
  double position = 0;                       // s: log f by the zoom reading
  std::optional<PanTilt<double>> telemetry;  // measured angles, rad
  Eigen::Quaterniond R_base_from_camera = Eigen::Quaterniond::Identity();
  double eps = 0;                                              // of log f
  Matrix4<double> covariance = Matrix4<double>::Zero();        // of xi in R Exp(xi) (rad) and log f
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  double residual_px = 0;                                      // rms over its sightings
  std::vector<std::uint8_t> picture;                           // coded luma; may be empty
};

struct SceneSighting {
  std::int64_t keyframe = 0;  // id
  Vector2<double> u;          // px
  double scale_px = 0;        // sigma of the blob
};

struct LandmarkLife {
  double born_utc_s = 0;
  double last_seen_utc_s = 0;
  // Views in which it should have been found, and of these the ones in which it was. Both are
  // halved at 200, so that old views fade.
  std::uint32_t looked_for = 0;
  std::uint32_t matched = 0;
  std::uint32_t missed = 0;  // consecutive views without it, up to the latest; 0: found there
};

struct SceneLandmark {
  std::int64_t id = 0;                             // 1 or more
  Vector3<double> d_b = Vector3<double>::UnitX();  // unit direction
  // rad^2, in tangent_basis(d_b). The error of d_b is the sum of two parts: an own one, independent
  // of other landmarks, and a part common with the neighbours. A pose found from the neighbours
  // cannot show the common part: it looks as if the base were turned. Poses are computed with the
  // own parts; the common part is added to the pose's covariance.
  Matrix2<double> covariance = Matrix2<double>::Zero();         // own part
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();  // common part
  double scale_rad = 0;        // sigma of the blob as an angle; > 0, < 1
  double focal_length_px = 0;  // with which its size was measured
  Descriptor descriptor{};
  LandmarkLife life;
  // By increasing keyframe id, at most one for each keyframe. Landmarks born after the map was
  // built have none.
  std::vector<SceneSighting> sightings;

  [[nodiscard]] Matrix2<double> whole_covariance() const { return covariance + shared_covariance; }
};

struct SceneMap {
  // Upper limits of a valid map. A map of this size with pictures exceeds a board's memory, see
  // scene_map_file.h.
  static constexpr std::size_t kMostKeyframes = 100'000;
  static constexpr std::size_t kMostLandmarks = 1'000'000;
  static constexpr std::size_t kMostSightings = 10'000'000;
  static constexpr std::size_t kMostPictureBytes = std::size_t{16} << 20;  // of one keyframe
  static constexpr std::size_t kMostNameBytes = 4096;                      // of a recording's name
  static constexpr int kMostImageSide = 16384;                             // px
  static constexpr int kMostLensPoints = 1000;

  LensCurve lens;                              // includes the image's size
  double line_delay = 0;                       // s/row, any sign
  double reference_row = 0;                    // px
  std::optional<Mechanics<double>> mechanics;  // empty: not known
  std::vector<SceneKeyframe> keyframes;        // by increasing id
  std::vector<SceneLandmark> landmarks;        // by increasing id
  std::int64_t next_landmark = 1;              // id; above all ids ever used

  [[nodiscard]] PictureMotion motion_of(const SceneKeyframe& keyframe) const {
    return {keyframe.angular_velocity, keyframe.zoom_rate, line_delay, reference_row};
  }
  [[nodiscard]] Camera<double> camera_of(const SceneKeyframe& keyframe) const {
    return lens.camera_at(keyframe.position, keyframe.eps);
  }
};

// Index of the keyframe or landmark with this id; -1 if there is none.
[[nodiscard]] std::ptrdiff_t keyframe_index(const SceneMap& map, std::int64_t id);
[[nodiscard]] std::ptrdiff_t landmark_index(const SceneMap& map, std::int64_t id);

// Whether every number is possible and every id exists. *error (may be null): one line that names
// the first fault.
[[nodiscard]] bool is_valid(const SceneMap& map, std::string* error = nullptr);
// The same for one part of any map. Whether a sighting's keyframe exists is not checked.
[[nodiscard]] bool is_valid(const SceneKeyframe& keyframe, std::string* error = nullptr);
[[nodiscard]] bool is_valid(const SceneLandmark& landmark, std::string* error = nullptr);

}  // namespace alidade

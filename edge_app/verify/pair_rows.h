#pragma once
// What a place in two pictures says about calibration and orientations, linearised:
//   r = seen - expected,   expected = the second picture's pixel for the place seen in the first
//   r = J_first e_first + J_second e_second + (P_first + P_second) e_theta + noise
// e: truth minus estimate; e_first and e_second of a frame's (pan, tilt, pan rate, tilt rate) at
// row 0, e_theta of the parameters (Parameter). P includes the parameters' effect by the frame's
// motion. px, rad, s. Pure; allocates.

#include <vector>

#include "core/model/calibration.h"
#include "edge_app/verify/place_pairs.h"

namespace alidade {

// See SeenFrame.
enum class OrientationFrom { kTelemetry, kAllSamples, kLandmarks };

struct PlaceRow {
  Vector2<double> at;          // px, in the second picture
  Vector2<double> moved;       // px, from the first picture to the second
  Vector2<double> residual;    // px
  Matrix2<double> covariance;  // px^2, noise
  Matrix<double, 2, 4> J_first, J_second;
  Sensitivity<2> P_first, P_second;
};

struct PairRows {
  std::size_t first = 0;  // index of the frame
  std::size_t second = 0;
  std::vector<PlaceRow> places;  // at least one
};

[[nodiscard]] inline const FrameOrientation& orientation(const SeenFrame& frame,
                                                         OrientationFrom from) {
  switch (from) {
    case OrientationFrom::kTelemetry:
      return frame.by_telemetry;
    case OrientationFrom::kAllSamples:
      return frame.by_all_samples;
    case OrientationFrom::kLandmarks:
      break;
  }
  return frame.by_landmarks;
}

inline constexpr double kSameZoom = 1e-3;  // of f

// Whether both were taken at one zoom, so that their calibrations have the same error.
[[nodiscard]] bool is_same_zoom(const FrameOrientation& a, const FrameOrientation& b);

// from: which orientation of each frame is used. A pair is left out if one of its frames has no
// such orientation.
[[nodiscard]] std::vector<PairRows> pair_rows(const std::vector<SeenFrame>& frames,
                                              const std::vector<PlacePair>& pairs,
                                              OrientationFrom from);

// Likewise by all samples, linearised where each frame has these errors instead of none; r still
// has the whole of e_first and e_second. What multiplies a rate, as the line delay's column does,
// is biased by the rate's error (errors in variables) unless the pictures correct it first.
// errors: of each frame.
[[nodiscard]] std::vector<PairRows> pair_rows_at(const std::vector<Vector4<double>>& errors,
                                                 const std::vector<SeenFrame>& frames,
                                                 const std::vector<PlacePair>& pairs);

}  // namespace alidade

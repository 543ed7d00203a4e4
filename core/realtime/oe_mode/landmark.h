#pragma once
// Landmark: a far point that the camera can recognise: its direction, the small image by which it is found
// again, how well both are known and how well they have served (PTCEE section V-A). Plain values.

#include <cstdint>

#include "core/model/calibration.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/image/reference_image.h"

namespace alidade {

// How it has served, over all frames that held: fine ones were looked for when they were chosen, and matched when
// they were inliers (landmark_search.h); coarse ones when they were compared, and looked alike.
struct LandmarkStatistics {
  std::uint32_t looked_for = 0;  // frames
  std::uint32_t matched = 0;     // of these
  std::uint16_t missed_in_a_row = 0;
  std::uint32_t last_frame = 0;  // count of frames when made or last looked for; 0: handed over
  // Mean square of the normalised residual when matched, running: 1 if its covariances are right.
  float residual_square = 1;
};

using LandmarkSensitivity = Matrix<float, 2, kParameterCount>;

struct Landmark {
  std::uint32_t id = 0;                          // never given twice by one map
  std::uint8_t octave = 0;                       // of the pyramid its image was taken from
  Vector3<double> d = Vector3<double>::UnitX();  // unit, in the map's frame
  // rad^2, of d in tangent_basis(d): its own part, independent of other landmarks' ...
  Matrix2<double> covariance = Matrix2<double>::Zero();
  // ... and rad^2 of (pan, tilt) of the frame that it came from, shared by all made there.
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();
  // Of d in tangent_basis(d): all that was made with the calibration shares its errors.
  LandmarkSensitivity sensitivity = LandmarkSensitivity::Zero();
  // d(reference pixel, px of its octave) / d(tangent_basis(d) coordinates, rad), as the camera saw
  // it then, rolling shutter and distortion included.
  Matrix2<double> J_pixel_tangent = Matrix2<double>::Identity();
  ReferencePixels pixels{};
  LandmarkStatistics statistics;

  // Lives as long as the landmark.
  [[nodiscard]] ImageView image() const { return view_of(pixels); }
};

}  // namespace alidade

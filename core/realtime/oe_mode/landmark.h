#pragma once
// Landmark: a far point that the camera recognises: its direction, its small reference image, their
// covariance and its record (PTCEE section V-A). Plain values.

#include <cstdint>

#include "core/model/calibration.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/image/reference_image.h"

namespace alidade {

// A landmark's record over all frames in which landmarks held. A fine landmark is looked for when
// it is chosen, and matched when it is an inlier (landmark_search.h). A coarse one is looked for
// when it is compared, and matched when it is similar.
struct LandmarkStatistics {
  std::uint32_t looked_for = 0;  // frames
  std::uint32_t matched = 0;     // of these
  std::uint16_t missed_in_a_row = 0;
  std::uint32_t last_frame = 0;  // frame count when made or last looked for; 0: handed over
  // Running mean square of the normalised residual when matched. 1 if the covariances are right.
  float residual_square = 1;
};

using LandmarkSensitivity = Matrix<float, 2, kParameterCount>;

struct Landmark {
  std::uint32_t id = 0;                          // never reused by one map
  std::uint8_t octave = 0;                       // of the pyramid, of its reference image
  Vector3<double> d = Vector3<double>::UnitX();  // unit, in the map's frame
  // rad^2, of d in tangent_basis(d): the own part, independent of other landmarks.
  Matrix2<double> covariance = Matrix2<double>::Zero();
  // rad^2, (pan, tilt) of the frame in which it was made: common to all landmarks made there.
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();
  // Sensitivity of d in tangent_basis(d). All landmarks made with the calibration share its errors.
  LandmarkSensitivity sensitivity = LandmarkSensitivity::Zero();
  // d(reference pixel, px of its octave) / d(tangent_basis(d) coordinates, rad) when it was made,
  // with rolling shutter and distortion.
  Matrix2<double> J_pixel_tangent = Matrix2<double>::Identity();
  ReferencePixels pixels{};
  LandmarkStatistics statistics;

  // Valid as long as the landmark.
  [[nodiscard]] ImageView image() const { return view_of(pixels); }
};

}  // namespace alidade

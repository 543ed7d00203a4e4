#pragma once
// What tracks alone can tell about the focal length of a turning camera: the image-only methods that
// PTCEE's Table I compares with. Global shutter, no distortion, square pixels, known optical centre.
//   dlt          every pair of frames that share enough landmarks: homography H by DLT; H W H^T = W
//                with W = K K^T = diag(f^2, f^2, 1) is linear in 1 / f^2 (Triggs 1997; PTCEE ref. 5)
//   adjustment   over focal lengths (one for each level of zoom), a rotation for each frame and the
//                directions of the landmarks, which all levels share (PTCEE ref. 1); Ceres
// The adjustments begin at the true rotations and directions: what is compared is what the data
// hold, not who finds it. Focal lengths in px.

#include <optional>
#include <vector>

#include "test/support/simulated_recording.h"

namespace alidade::test {

// One level of zoom: its recording and the focal length to begin at.
struct ZoomLevel {
  const Simulation* simulation = nullptr;
  const SimulatedRecording* recording = nullptr;
  double first_focal_length = 0;
  // The grid's step in steps of the narrowest level's: landmarks at the same place are the same.
  int grid_factor = 1;
};

// Empty where the least squares give 1 / f^2 <= 0.
[[nodiscard]] std::optional<double> focal_length_by_dlt(const SimulatedRecording& recording);

// The focal length of the last level; empty if Ceres does not converge.
[[nodiscard]] std::optional<double> focal_length_by_adjustment(
    const std::vector<ZoomLevel>& levels);

}  // namespace alidade::test

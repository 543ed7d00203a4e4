#pragma once
// Eliminates the landmarks from the normal equations H x = g: given x, each landmark's direction is
// the best one. What remains is S = H - Y Y^T and g - Y y, with Y = [H_touched; H_camera] L^-T,
// y = L^-1 g_landmark, L L^T = H_landmark (Linearisation). Y has two columns for each block of
// H_landmark.

#include <Eigen/Cholesky>
#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

using CameraRows = Eigen::Matrix<double, kObservedCount, 2>;

// The columns of Y that belong to one block, and its part of y (gradient). landmark: the block's
// index in H_landmark. points: the rows of the control points that it touches, in the order of
// Linearisation::touched. camera: the rows of the first kObservedCount parameters.
struct EliminatedLandmark {
  std::size_t landmark = 0;
  std::vector<Matrix2<double>> points;
  CameraRows camera;
  Vector2<double> gradient;
};

// Calls use(const EliminatedLandmark&) for each block of a landmark with an observation in use; the
// argument is valid during the call. The diagonal of each block is multiplied by 1 + damping. False
// if a block is not positive definite; `use` is not called for it and those after it.
template <class Use>
[[nodiscard]] bool eliminate_landmarks(const Linearisation& in, double damping, Use use) {
  EliminatedLandmark out;
  for (std::size_t l = 0; l < in.H_landmark.size(); ++l) {
    const std::size_t begin = in.touched_begin[l];
    const std::size_t end = in.touched_begin[l + 1];
    if (begin == end) continue;  // no observation is in use
    Matrix2<double> V = in.H_landmark[l];
    V.diagonal() *= 1 + damping;
    const Eigen::LLT<Matrix2<double>> llt(V);
    if (llt.info() != Eigen::Success) return false;
    const Matrix2<double> root_inverse = llt.matrixL().solve(Matrix2<double>::Identity());
    out.landmark = l;
    out.gradient = root_inverse * in.g_landmark[l];
    out.camera = in.H_camera[l] * root_inverse.transpose();
    out.points.resize(end - begin);
    for (std::size_t i = begin; i < end; ++i)
      out.points[i - begin] = in.H_touched[i] * root_inverse.transpose();
    use(static_cast<const EliminatedLandmark&>(out));
  }
  return true;
}

}  // namespace alidade::internal

#pragma once
// Eliminates the landmarks from the normal equations H x = g: given x, each landmark's direction is
// the best one. What remains is S = H - Y Y^T and g - Y y, with Y = H_touched L^-T,
// y = L^-1 g_landmark, L L^T = H_landmark. Y has two columns for each landmark.

#include <Eigen/Cholesky>
#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

using CameraRows = Eigen::Matrix<double, kObservedCount, 2>;

// The columns of Y that belong to one landmark, and its part of y (gradient). points: the control
// points in Linearisation::touched, in its order.
struct EliminatedLandmark {
  std::size_t landmark = 0;
  std::vector<Matrix2<double>> points;
  CameraRows camera;
  Vector2<double> gradient;
};

// Calls use(const EliminatedLandmark&) for each observed landmark; the argument is valid during the
// call. The diagonal of each landmark's block is multiplied by 1 + damping. False if a landmark's
// block is not positive definite.
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

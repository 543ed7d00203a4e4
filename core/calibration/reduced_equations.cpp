#include "core/calibration/reduced_equations.h"

#include <cmath>
#include <cstddef>

namespace alidade::internal {

bool ReducedEquations::set(const Linearisation& in, double damping) {
  in_ = &in;
  damping_ = damping;
  const Eigen::Index points = in.H.rows() - kGlobalCount;
  border_ = in.H.border().leftCols(points);
  corner_ = in.H.border().rightCols<kGlobalCount>();
  corner_.diagonal() *= 1 + damping;
  g_ = in.g;
  Y_points_.clear();
  Y_camera_.assign(in.H_landmark.size(), CameraRows::Zero());
  const bool regular = eliminate_landmarks(in, damping, [&](const EliminatedLandmark& Y) {
    const int* row = &in.touched[in.touched_begin[Y.landmark]];
    for (const Matrix2<double>& Y_i : Y.points) {
      border_.block<kObservedCount, 2>(0, 2 * *row) -= Y.camera * Y_i.transpose();
      g_.segment<2>(2 * *row) -= Y_i * Y.gradient;
      ++row;
    }
    corner_.topLeftCorner<kObservedCount, kObservedCount>() -= Y.camera * Y.camera.transpose();
    g_.segment<kObservedCount>(points) -= Y.camera * Y.gradient;
    Y_points_.insert(Y_points_.end(), Y.points.begin(), Y.points.end());
    Y_camera_[Y.landmark] = Y.camera;
  });
  return regular && factorise();
}

bool ReducedEquations::factorise() {
  const Eigen::Index points = border_.cols();
  std::vector<Eigen::Triplet<double>> entries;
  in_->H.for_each([&](Eigen::Index i, Eigen::Index j, double h) {
    if (i >= points) return;
    entries.emplace_back(static_cast<int>(i), static_cast<int>(j), i == j ? (1 + damping_) * h : h);
  });
  Eigen::SparseMatrix<double> B(points, points);
  B.setFromTriplets(entries.begin(), entries.end());
  band_.compute(B);
  if (band_.info() != Eigen::Success) return false;
  band_inverse_ = band_.solve(border_.transpose());
  rest_.compute(corner_ - border_ * band_inverse_);
  return rest_.info() == Eigen::Success;
}

Eigen::VectorXd ReducedEquations::times(const Eigen::VectorXd& x) const {
  Eigen::VectorXd product = Eigen::VectorXd::Zero(x.size());
  in_->H.for_each([&](Eigen::Index i, Eigen::Index j, double h) {
    if (i == j) {
      product[i] += (1 + damping_) * h * x[i];
      return;
    }
    product[i] += h * x[j];
    product[j] += h * x[i];
  });
  const Eigen::Index points = border_.cols();
  const Eigen::Matrix<double, kObservedCount, 1> x_camera = x.segment<kObservedCount>(points);
  Eigen::Matrix<double, kObservedCount, 1> of_camera =
      Eigen::Matrix<double, kObservedCount, 1>::Zero();
  for (std::size_t l = 0; l < Y_camera_.size(); ++l) {
    const std::size_t begin = in_->touched_begin[l];
    const std::size_t end = in_->touched_begin[l + 1];
    Vector2<double> sum = Y_camera_[l].transpose() * x_camera;
    for (std::size_t i = begin; i < end; ++i)
      sum += Y_points_[i].transpose() * x.segment<2>(2 * in_->touched[i]);
    for (std::size_t i = begin; i < end; ++i)
      product.segment<2>(2 * in_->touched[i]) -= Y_points_[i] * sum;
    of_camera += Y_camera_[l] * sum;
  }
  product.segment<kObservedCount>(points) -= of_camera;
  return product;
}

Eigen::VectorXd ReducedEquations::preconditioned(const Eigen::VectorXd& r) const {
  const Eigen::Index points = border_.cols();
  Eigen::VectorXd out(r.size());
  const Eigen::VectorXd of_points = band_.solve(r.head(points));
  out.tail<kGlobalCount>() = rest_.solve(r.tail<kGlobalCount>() - border_ * of_points);
  out.head(points) = of_points - band_inverse_ * out.tail<kGlobalCount>();
  return out;
}

bool ReducedEquations::solve(const Eigen::VectorXd& b, double tolerance, Eigen::VectorXd* x) const {
  constexpr int kMaxSteps = 200;
  x->setZero(b.size());
  Eigen::VectorXd r = b;
  Eigen::VectorXd z = preconditioned(r);
  Eigen::VectorXd p = z;
  double error = r.dot(z);
  const double first = error;
  if (first == 0) return true;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::VectorXd q = times(p);
    const double curvature = p.dot(q);
    if (!(curvature > 0)) return false;
    const double length = error / curvature;
    *x += length * p;
    r -= length * q;
    z = preconditioned(r);
    const double left = r.dot(z);
    if (left <= tolerance * tolerance * first) return true;
    p = z + left / error * p;
    error = left;
  }
  return false;
}

}  // namespace alidade::internal

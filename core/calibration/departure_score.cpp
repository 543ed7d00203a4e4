#include "core/calibration/departure_score.h"

#include <Eigen/Cholesky>
#include <cstddef>

#include "core/calibration/landmark_elimination.h"

namespace alidade::internal {

DepartureScore::DepartureScore(int columns, const Linearisation& at)
    : at_(&at),
      score_(Eigen::VectorXd::Zero(columns)),
      full_(Eigen::MatrixXd::Zero(columns, columns)),
      cross_(Eigen::MatrixXd::Zero(at.H.rows(), columns)),
      cross_landmark_(at.H_landmark.size()) {}

void DepartureScore::add(const ObservationRow& row, int first, const DepartureColumns& X) {
  const Eigen::Index columns = X.cols();
  score_.segment(first, columns) += X.transpose() * row.error;
  full_.block(first, first, columns, columns).noalias() += X.transpose() * X;
  const DepartureColumns of_angle = row.J_angle.transpose() * X;
  for (int i = 0; i < 4; ++i) {
    cross_.block(2 * (row.basis.segment + i), first, 2, columns) += row.basis.weight[i] * of_angle;
  }
  cross_.block(cross_.rows() - kGlobalCount, first, kObservedCount, columns).noalias() +=
      row.J_camera.transpose() * X;
  DepartureColumns& of_landmark = cross_landmark_[static_cast<std::size_t>(row.landmark)];
  if (of_landmark.size() == 0) of_landmark.setZero(2, score_.size());
  of_landmark.middleCols(first, columns) += row.J_landmark.transpose() * X;
  if (at_->direction_by_nearness.empty()) return;
  DepartureColumns& of_nearness =
      cross_landmark_[at_->direction_by_nearness.size() + static_cast<std::size_t>(row.landmark)];
  if (of_nearness.size() == 0) of_nearness.setZero(2, score_.size());
  of_nearness.row(0).segment(first, columns) += row.J_nearness.transpose() * X;
}

void DepartureScore::add(const TelemetryRow& row, int first, const DepartureColumns& X) {
  const Eigen::Index columns = X.cols();
  score_.segment(first, columns) += X.transpose() * row.error;
  full_.block(first, first, columns, columns).noalias() += X.transpose() * X;
  const DepartureColumns of_angle = row.slope.asDiagonal() * X;
  for (int i = 0; i < 4; ++i) {
    cross_.block(2 * (row.basis.segment + i), first, 2, columns) += row.basis.weight[i] * of_angle;
  }
  cross_.block(cross_.rows() - kGlobalCount + kObservedCount, first, 4, columns).noalias() +=
      row.J.transpose() * X;
}

void DepartureScore::finish(const ReducedFactor& factor, const Adjustment& adjustment,
                            std::vector<DepartureScore>* scores) {
  if (scores->empty()) return;
  const Linearisation& at = *scores->front().at_;
  const Eigen::Index first_global = at.H.rows() - kGlobalCount;
  for (DepartureScore& score : *scores) score.information_ = score.full_;
  // The landmarks' blocks are positive definite: the adjustment has solved them.
  (void)eliminate_landmarks(at, 0, [&](const EliminatedLandmark& Y) {
    const Eigen::LLT<Matrix2<double>> llt(at.H_landmark[Y.landmark]);
    const int* touched = &at.touched[at.touched_begin[Y.landmark]];
    for (DepartureScore& score : *scores) {
      const DepartureColumns& x = score.cross_landmark_[Y.landmark];
      if (x.size() == 0) continue;
      const DepartureColumns z = llt.matrixL().solve(x);
      for (std::size_t i = 0; i < Y.points.size(); ++i) {
        score.cross_.middleRows<2>(2 * touched[i]).noalias() -= Y.points[i] * z;
      }
      score.cross_.middleRows<kObservedCount>(first_global).noalias() -= Y.camera * z;
      score.information_.noalias() -= z.transpose() * z;
    }
  });
  for (DepartureScore& score : *scores) {
    for (int i = 0; i < kGlobalCount; ++i) {
      if (adjustment.fixed()[static_cast<std::size_t>(i)]) {
        score.cross_.row(first_global + i).setZero();
      }
    }
    score.effect_ = adjustment.global_rows() * score.cross_;
    const Eigen::MatrixXd half = factor.half_solve(score.cross_);
    score.information_.noalias() -= half.transpose() * half;
  }
}

}  // namespace alidade::internal

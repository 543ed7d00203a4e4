#include "core/calibration/drift_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/model/median.h"

namespace alidade::internal {

namespace {

constexpr std::size_t kMostRows = 60000;
constexpr double kFittingSigmas = 3;         // sigmas
constexpr double kMedianOfSquares = 1.386;   // of two degrees of freedom
constexpr double kLargestRate_rad_s = 0.01;  // prior of a drift: it is none of a landmark seen once

// Rows and columns of a track's unknowns in the equations of all.
template <class Use>
void for_each_place(const std::vector<int>& points, Eigen::Index first_global, Use use) {
  Eigen::Index local = 0;
  for (const int point : points) {
    use(local, 2 * point, 2);
    local += 2;
  }
  use(local, first_global, kObservedCount);
}

}  // namespace

DriftFit::DriftFit(AdjustmentData* data, const AdjustmentState& state, Adjustment* adjustment)
    : fixed_(adjustment->fixed()), tracks_(state.landmarks.size()) {
  std::vector<char> marks;
  marks.reserve(data->observations.size());
  const auto use_all = [&](bool used) {
    for (auto& o : data->observations) o.used = used;
  };
  for (const auto& o : data->observations) marks.push_back(o.used ? 1 : 0);
  Linearisation at;
  use_all(false);
  LossScales loss;
  loss.telemetry = kFittingSigmas;
  adjustment->linearise(state, loss, &at);
  at.H.copy_to(&known_);
  known_ = known_.selfadjointView<Eigen::Lower>();
  known_gradient_ = at.g;
  use_all(true);
  adjustment->linearise(state, loss, &at);
  const auto every = static_cast<int>(1 + data->observations.size() / kMostRows);
  adjustment->visit(
      state, at,
      [&](const ObservationRow& row) {
        if (data->observations[row.index].frame % every != 0) return;
        Row kept{row.landmark, row.time_s,     row.basis,    row.error,
                 row.J_angle,  row.J_landmark, row.J_camera, 1};
        for (int i = 0; i < kObservedCount; ++i) {
          if (fixed_[static_cast<std::size_t>(i)]) kept.J_camera.col(i).setZero();
        }
        rows_.push_back(kept);
      },
      [](const TelemetryRow&) {});
  for (std::size_t i = 0; i < marks.size(); ++i) data->observations[i].used = marks[i] != 0;
  find_tracks();

  constexpr int kRounds = 3;
  const std::vector<TrackMotion> free(tracks_.size(), TrackMotion::kFree);
  double cost = 0;
  for (int round = 0; round <= kRounds; ++round) {
    form_equations();
    if (round == kRounds || !solve(free, Vector2<double>::Zero(), &cost)) break;
    weigh();
  }
}

void DriftFit::find_tracks() {
  for (const Row& row : rows_) {
    Track& track = tracks_[static_cast<std::size_t>(row.landmark)];
    if (track.observations == 0) track.begin_s = row.time_s;
    track.end_s = row.time_s;
    track.middle_s += row.time_s;
    ++track.observations;
    for (int i = 0; i < 4; ++i) {
      const int point = row.basis.segment + i;
      const auto place = std::lower_bound(track.points.begin(), track.points.end(), point);
      if (place == track.points.end() || *place != point) track.points.insert(place, point);
    }
  }
  for (Track& track : tracks_) track.middle_s /= std::max(1, track.observations);
}

void DriftFit::form_equations() {
  normal_ = known_;
  gradient_ = known_gradient_;
  const Eigen::Index first_global = normal_.rows() - kGlobalCount;
  for (Track& track : tracks_) {
    track.cross.setZero(2 * static_cast<Eigen::Index>(track.points.size()) + kObservedCount, 4);
    track.normal.setZero();
    track.normal.bottomRightCorner<2, 2>().diagonal().setConstant(
        1 / (kLargestRate_rad_s * kLargestRate_rad_s));
    track.gradient.setZero();
  }
  for (const Row& row : rows_) {
    Track& track = tracks_[static_cast<std::size_t>(row.landmark)];
    Eigen::Matrix<double, 2, 4> X;
    X << row.J_landmark, (row.time_s - track.middle_s) * row.J_angle;
    Eigen::Matrix<double, 2, 8 + kObservedCount> J;
    for (int i = 0; i < 4; ++i) J.middleCols<2>(2 * i) = row.basis.weight[i] * row.J_angle;
    J.rightCols<kObservedCount>() = row.J_camera;
    track.normal += row.weight * X.transpose() * X;
    track.gradient += row.weight * X.transpose() * row.error;
    const Eigen::Matrix<double, 8 + kObservedCount, 4> cross = row.weight * J.transpose() * X;
    const Eigen::Matrix<double, 8 + kObservedCount, 8 + kObservedCount> square =
        row.weight * J.transpose() * J;
    const Eigen::Matrix<double, 8 + kObservedCount, 1> g = row.weight * J.transpose() * row.error;
    const Eigen::Index first = 2 * row.basis.segment;
    const auto place =
        std::lower_bound(track.points.begin(), track.points.end(), row.basis.segment);
    track.cross.middleRows<8>(2 * (place - track.points.begin())) += cross.topRows<8>();
    track.cross.bottomRows<kObservedCount>() += cross.bottomRows<kObservedCount>();
    normal_.block<8, 8>(first, first) += square.topLeftCorner<8, 8>();
    normal_.block<kObservedCount, 8>(first_global, first) +=
        square.bottomLeftCorner<kObservedCount, 8>();
    normal_.block<kObservedCount, kObservedCount>(first_global, first_global) +=
        square.bottomRightCorner<kObservedCount, kObservedCount>();
    gradient_.segment<8>(first) += g.head<8>();
    gradient_.segment<kObservedCount>(first_global) += g.tail<kObservedCount>();
  }
}

bool DriftFit::solve(const std::vector<TrackMotion>& motions, const Vector2<double>& shared_rate,
                     double* cost) {
  Eigen::MatrixXd S = normal_;
  Eigen::VectorXd g = gradient_;
  const Eigen::Index first_global = S.rows() - kGlobalCount;
  double gained = 0;
  for (std::size_t l = 0; l < tracks_.size(); ++l) {
    const Track& track = tracks_[l];
    if (track.observations < 2) continue;
    const Eigen::Index unknowns = motions[l] == TrackMotion::kFree ? 4 : 2;
    const Eigen::LLT<Eigen::MatrixXd> llt(track.normal.topLeftCorner(unknowns, unknowns));
    if (llt.info() != Eigen::Success) continue;
    Vector4<double> of_track = track.gradient;
    Eigen::VectorXd known = Eigen::VectorXd::Zero(track.cross.rows());
    if (motions[l] == TrackMotion::kShared) {
      of_track -= track.normal.rightCols<2>() * shared_rate;
      known = track.cross.rightCols<2>() * shared_rate;
      gained += 2 * shared_rate.dot(track.gradient.tail<2>()) -
                shared_rate.dot(track.normal.bottomRightCorner<2, 2>() * shared_rate);
    }
    const Eigen::MatrixXd Y = llt.matrixL().solve(track.cross.leftCols(unknowns).transpose());
    const Eigen::VectorXd y = llt.matrixL().solve(of_track.head(unknowns));
    gained += y.squaredNorm();
    const Eigen::MatrixXd square = Y.transpose() * Y;
    const Eigen::VectorXd linear = Y.transpose() * y + known;
    for_each_place(track.points, first_global, [&](Eigen::Index a, Eigen::Index row, int rows) {
      g.segment(row, rows) -= linear.segment(a, rows);
      for_each_place(track.points, first_global,
                     [&](Eigen::Index b, Eigen::Index column, int columns) {
                       if (column > row) return;
                       S.block(row, column, rows, columns) -= square.block(a, b, rows, columns);
                     });
    });
  }
  const Eigen::VectorXd scale = S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  S = scale.asDiagonal() * S * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return false;
  solution_ = scale.asDiagonal() * llt.solve(scale.cwiseProduct(g));
  if (!solution_.allFinite()) return false;
  gained += g.dot(solution_);
  *cost = -gained;
  for (Track& track : tracks_) {
    if (track.observations < 2) continue;
    track.rate = landmark_solution(track).tail<2>();
    track.covariance = noise_square_ * track.normal.inverse().bottomRightCorner<2, 2>();
  }
  return true;
}

Vector4<double> DriftFit::landmark_solution(const Track& track) const {
  Vector4<double> g = track.gradient;
  const Eigen::Index first_global = solution_.size() - kGlobalCount;
  for_each_place(track.points, first_global, [&](Eigen::Index a, Eigen::Index row, int rows) {
    g -= track.cross.middleRows(a, rows).transpose() * solution_.segment(row, rows);
  });
  return track.normal.ldlt().solve(g);
}

void DriftFit::weigh() {
  std::vector<double> squares;
  squares.reserve(rows_.size());
  const Eigen::Index first_global = solution_.size() - kGlobalCount;
  int landmark = -1;
  Vector4<double> of_landmark = Vector4<double>::Zero();
  for (const Row& row : rows_) {
    const Track& track = tracks_[static_cast<std::size_t>(row.landmark)];
    if (row.landmark != landmark) {
      landmark = row.landmark;
      of_landmark = track.observations < 2 ? Vector4<double>(Vector4<double>::Zero())
                                           : landmark_solution(track);
    }
    Vector2<double> angle = (row.time_s - track.middle_s) * of_landmark.tail<2>();
    for (int i = 0; i < 4; ++i) {
      angle += row.basis.weight[i] * solution_.segment<2>(2 * (row.basis.segment + i));
    }
    const Vector2<double> left = row.error - row.J_angle * angle -
                                 row.J_landmark * of_landmark.head<2>() -
                                 row.J_camera * solution_.segment<kObservedCount>(first_global);
    squares.push_back(left.squaredNorm());
  }
  noise_square_ = std::max(1.0, median(squares) / kMedianOfSquares);
  const double c = kFittingSigmas * kFittingSigmas * noise_square_;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const double fall = 1 / (1 + squares[i] / c);
    rows_[i].weight = fall * fall;
  }
}

}  // namespace alidade::internal

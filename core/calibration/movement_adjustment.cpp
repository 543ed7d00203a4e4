#include "core/calibration/movement_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/calibration/partial_inverse.h"
#include "core/model/direction.h"
#include "core/model/median.h"

namespace alidade::internal {
namespace {

constexpr double kFramesPerSegment = 1.5;
constexpr int kMaxSegments = 300;
constexpr double kStartSigma_rad = 1e-4;
constexpr double kOutlierSigmas = 4;

ZoomMotionSpline spline_over(const MovementData& data) {
  const double length = std::max(0.1, data.end_s - data.begin_s);
  const double spacing = std::max(0.01, kFramesPerSegment * data.frame_period_s);
  const int segments = std::clamp(static_cast<int>(std::ceil(length / spacing)), 4, kMaxSegments);
  std::vector<double> knots;
  for (int i = 0; i <= segments; ++i) knots.push_back(data.begin_s + length * i / segments);
  return ZoomMotionSpline(knots);
}

}  // namespace

MovementAdjustment::MovementAdjustment(MovementData data, const ZoomCurve& curve)
    : data_(std::move(data)),
      curve_(curve),
      shared_(curve.content().shared),
      spline_(spline_over(data_)),
      telemetry_sigma_(data_.pan_tilt_sigma_rad > 0 ? data_.pan_tilt_sigma_rad : kStartSigma_rad) {
  for (int i = 0; i < spline_.control_points(); ++i) {
    // A control point has an effect from three knots before it on.
    const auto knot = [&](int k) {
      const double spacing = (spline_.end_s() - spline_.begin_s()) / spline_.segments();
      return spline_.begin_s() + k * spacing;
    };
    int unknown = 2 + log_f_unknowns_;
    if (knot(i - 3) < data_.rest_ends_s) {
      unknown = 0;
    } else if (knot(i + 1) > data_.rest_begins_s) {
      unknown = 1;
    } else {
      ++log_f_unknowns_;
    }
    log_f_unknown_.push_back(unknown);
  }
  log_f_unknowns_ += 2;
  set_places();
  unknowns_ = first_beside() + kBeside * kPlaces;
  set_start();
  set_landmarks();
}

int MovementAdjustment::log_f_unknown(int control_point) const {
  return first_log_f() + log_f_unknown_[static_cast<std::size_t>(control_point)];
}

void MovementAdjustment::apply(const Eigen::VectorXd& x,
                               const std::vector<Vector2<double>>& x_landmark) {
  for (int i = 0; i < spline_.control_points(); ++i) {
    spline_.control_point(i) +=
        Vector3<double>(x[point_row(i)], x[point_row(i) + 1], x[log_f_unknown(i)]);
  }
  for (int i = 0; i < kBeside * kPlaces; ++i) {
    beside_(i % kBeside, i / kBeside) += x[first_beside() + i];
  }
  for (std::size_t l = 0; l < landmarks_.size(); ++l) {
    landmarks_[l] = direction_plus<double>(landmarks_[l], x_landmark[l]).normalized();
  }
}

void MovementAdjustment::minimise(double loss_px, int max_steps, Normal* at) {
  constexpr double kTolerance = 1e-3;  // of cost
  double damping = 1e-6;
  linearise(loss_px, true, at);
  for (int step = 0; step < max_steps; ++step) {
    Eigen::VectorXd x;
    std::vector<Vector2<double>> x_landmark;
    if (!solve(*at, damping, &x, &x_landmark)) {
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    const ZoomMotionSpline spline = spline_;
    const BesideColumns beside = beside_;
    const std::vector<Vector3<double>> landmarks = landmarks_;
    apply(x, x_landmark);
    Normal next;
    linearise(loss_px, false, &next);
    const double gained = at->cost - next.cost;
    if (!(gained >= 0)) {
      spline_ = spline;
      beside_ = beside;
      landmarks_ = landmarks;
      if (gained > -kTolerance) break;
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    damping = std::max(1e-12, damping / 10);
    linearise(loss_px, true, at);
    if (gained < kTolerance) break;
  }
}

void MovementAdjustment::mark_outliers(const Normal& at) {
  auto& observations = data_.input.observations;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const double square = at.pixel_square[i];
    observations[i].used =
        square >= 0 &&
        square < kOutlierSigmas * kOutlierSigmas * std::max(1.0, std::pow(pixel_sigma_ratio_, 2));
  }
  // A landmark seen once says nothing.
  std::vector<int> sightings(landmarks_.size(), 0);
  for (const AdjustmentObservation& seen : observations) {
    if (seen.used) ++sightings[static_cast<std::size_t>(seen.landmark)];
  }
  for (AdjustmentObservation& seen : observations) {
    if (sightings[static_cast<std::size_t>(seen.landmark)] < 2) seen.used = false;
  }
}

bool MovementAdjustment::run(std::string* error) {
  // The median of |e|^2 of two unit normals is 2 log 2.
  const double median_square = 2 * std::log(2.0);
  Normal at;
  const auto settle = [&] {
    std::vector<double> squares;
    for (std::size_t i = 0; i < at.pixel_square.size(); ++i) {
      if (at.pixel_square[i] >= 0 && data_.input.observations[i].used)
        squares.push_back(at.pixel_square[i]);
    }
    if (squares.empty()) return false;
    pixel_sigma_ratio_ = std::sqrt(median(std::move(squares)) / median_square);
    if (data_.pan_tilt_sigma_rad <= 0 && at.telemetry_count > 0) {
      telemetry_sigma_ *=
          std::clamp(std::sqrt(at.telemetry_square / at.telemetry_count) * 1.05, 0.2, 5.0);
    }
    return true;
  };
  linearise(std::numeric_limits<double>::infinity(), false, &at);
  for (int round = 0; round < 5; ++round) {
    if (!settle()) {
      *error = "no landmark can be placed";
      return false;
    }
    minimise(3 * std::max(1.0, pixel_sigma_ratio_), 10, &at);
  }
  (void)settle();
  mark_outliers(at);
  minimise(std::numeric_limits<double>::infinity(), 10, &at);

  double square = 0;
  int count = 0;
  std::vector<char> is_used(landmarks_.size(), 0);
  for (std::size_t i = 0; i < at.pixel_square.size(); ++i) {
    const AdjustmentObservation& seen = data_.input.observations[i];
    if (!seen.used || at.pixel_square[i] < 0) continue;
    square += at.pixel_square[i];
    count += 2;
    is_used[static_cast<std::size_t>(seen.landmark)] = 1;
  }
  const auto placed = static_cast<int>(std::count(is_used.begin(), is_used.end(), 1));
  const int freedom = count + at.telemetry_count - 2 * placed - unknowns_;
  if (freedom < unknowns_) {
    *error = "too few tracks agree with one movement";
    return false;
  }
  pixel_sigma_ratio_ = std::sqrt((square + at.telemetry_square) / freedom);
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  if (!reduce(at, 0, &H, &g)) {
    *error = "a landmark is left undetermined";
    return false;
  }
  covariance_ = scaled_inverse(H.selfadjointView<Eigen::Lower>());
  if (covariance_.size() == 0) {
    *error = "the tracks leave the movement undetermined";
    return false;
  }
  covariance_ *= std::max(1.0, std::pow(pixel_sigma_ratio_, 2));
  return true;
}

Eigen::VectorXd MovementAdjustment::log_f_row(double time_s) const {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns_);
  const ZoomMotionSpline::Basis at = basis(time_s);
  for (int i = 0; i < 4; ++i) row[log_f_unknown(at.segment + i)] += at.weight[i];
  return row;
}

}  // namespace alidade::internal

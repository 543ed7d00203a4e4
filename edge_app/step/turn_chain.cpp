#include "edge_app/step/turn_chain.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/model/rotation.h"

namespace alidade {
namespace {

constexpr int kLeastPoints = 12;
constexpr double kLongest_s = 0.5;  // from a frame to the next
// Of a point's position. Its own sigma covers neither what all its positions share nor a tracker's
// errors between frames.
constexpr double kPointSigma_px = 0.15;
// Of the variance: points near each other share errors.
constexpr double kInflation = 4;
constexpr double kCauchy = 3;  // sigmas

}  // namespace

void TurnChain::take(const Calibration& calibration, const FrameTracks& tracks) {
  std::swap(before_, now_);
  before_count_ = now_count_;
  now_count_ = 0;
  for (int i = 0; i < tracks.count; ++i) {
    const TrackedPoint& point = tracks.points[static_cast<std::size_t>(i)];
    Ray ray;
    if (unproject(calibration.camera, {point.u_px, point.v_px}, &ray.d) != ProjectionStatus::kOk)
      continue;
    ray.landmark = point.landmark;
    ray.v = point.v_px;
    ray.sigma = std::hypot(point.sigma_px, kPointSigma_px) / calibration.camera.focal_length;
    now_[static_cast<std::size_t>(now_count_++)] = ray;
  }
  std::sort(now_.begin(), now_.begin() + now_count_,
            [](const Ray& a, const Ray& b) { return a.landmark < b.landmark; });
}

std::optional<TurnChain::Step> TurnChain::step(double line_delay, double elapsed_s) const {
  constexpr int kRounds = 8;
  Step out;
  out.turn.setZero();
  Matrix3<double> normal;
  double misfit = 1;
  for (int round = 0; round < kRounds; ++round) {
    normal.setZero();
    Vector3<double> right = Vector3<double>::Zero();
    double sum = 0;
    double weights = 0;
    int common = 0;
    for (int i = 0, k = 0; i < now_count_; ++i) {
      const Ray& now = now_[static_cast<std::size_t>(i)];
      while (k < before_count_ && before_[static_cast<std::size_t>(k)].landmark < now.landmark) ++k;
      if (k == before_count_) break;
      const Ray& before = before_[static_cast<std::size_t>(k)];
      if (before.landmark != now.landmark) continue;
      ++common;
      const double share = 1 + line_delay * (now.v - before.v) / elapsed_s;
      const Vector3<double> turn = share * out.turn;
      const Vector3<double> there = exp_so3(turn) * now.d;
      const Vector3<double> off = before.d - there;
      const double variance = now.sigma * now.sigma + before.sigma * before.sigma;
      const double square = off.squaredNorm() / variance;
      // The first rounds take in points that a start without a turn leaves far off.
      const double weight = round < 2 ? 1 : 1 / (1 + square / (kCauchy * kCauchy * misfit));
      const Matrix3<double> J = -share * skew(there);
      normal += weight / variance * (J.transpose() * J);
      right += weight / variance * (J.transpose() * off);
      sum += weight * square / 2;
      weights += weight;
    }
    if (common < kLeastPoints || weights < kLeastPoints / 2.0) return std::nullopt;
    misfit = std::max(1.0, sum / weights);
    const Eigen::LDLT<Matrix3<double>> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
    const Vector3<double> change = solver.solve(right);
    if (!all_finite(change)) return std::nullopt;
    out.turn += change;
  }
  out.covariance =
      kInflation * misfit *
      Eigen::LDLT<Matrix3<double>>(normal).solve(Matrix3<double>(Matrix3<double>::Identity()));
  // Beyond this most points move by themselves, or the rays are another lens's.
  constexpr double kMostMisfit = 100;
  if (!all_finite(out.covariance) || misfit > kMostMisfit) return std::nullopt;
  return out;
}

void TurnChain::add(const Calibration& calibration, const FrameTracks& tracks) {
  take(calibration, tracks);
  const double elapsed_s = tracks.time_s - time_s_;
  time_s_ = tracks.time_s;
  velocity_.reset();
  std::optional<Step> by;
  if (elapsed_s > 0 && elapsed_s < kLongest_s) by = step(calibration.line_delay, elapsed_s);
  if (!by) {
    holds_ = false;
    return;
  }
  step_s_ = elapsed_s;
  velocity_ = by->turn / elapsed_s;
  velocity_covariance_ = by->covariance / (elapsed_s * elapsed_s);
  if (!holds_) return;
  const Matrix3<double> R_before_from_now = exp_so3(by->turn);
  R_first_from_now_ = R_first_from_now_ * R_before_from_now;
  const Matrix3<double> carried = R_before_from_now.transpose() * covariance_ * R_before_from_now;
  covariance_ = carried + by->covariance;
}

bool TurnChain::begin() {
  holds_ = velocity_.has_value();
  R_first_from_now_.setIdentity();
  covariance_.setZero();
  return holds_;
}

void TurnChain::forget() {
  now_count_ = 0;
  velocity_.reset();
  holds_ = false;
}

}  // namespace alidade

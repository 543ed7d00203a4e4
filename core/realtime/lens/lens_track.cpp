#include "core/realtime/lens/lens_track.h"

#include <cmath>

namespace alidade {
namespace {

// Sigma of the rate at rest: smaller rates do not show.
constexpr double kRestingRate = 1e-6;  // 1/s

}  // namespace

bool LensTrackOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(least_sigma > 0)) problem = "least_sigma must be positive";
  if (!(drift >= 0)) problem = "drift must not be negative";
  if (!(acceleration > 0)) problem = "acceleration must be positive";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

void LensTrack::begin(double time_s, double log_focal_length) {
  active_ = true;
  rested_ = false;
  time_s_ = time_s;
  state_ = {};
  state_.value[0] = log_focal_length;
  state_.covariance(0, 0) = options_.least_sigma * options_.least_sigma;
  state_.covariance(1, 1) = kRestingRate * kRestingRate;
}

LensTrack::State LensTrack::predicted(double time_s, bool moves) const {
  const double dt = time_s - time_s_;
  State out = state_;
  if (!moves && rested_) {
    out.value[1] = 0;
    out.covariance.setZero();
    out.covariance(0, 0) = state_.covariance(0, 0) + options_.drift * options_.drift * std::abs(dt);
    out.covariance(1, 1) = kRestingRate * kRestingRate;
    out.sensitivity.row(1).setZero();
    return out;
  }
  Matrix2<double> carry;
  carry << 1, dt, 0, 1;
  const Vector2<double> push(dt * dt / 2, dt);
  out.value = carry * state_.value;
  out.covariance = carry * state_.covariance * carry.transpose() +
                   options_.acceleration * options_.acceleration * push * push.transpose();
  out.covariance = symmetric(out.covariance);
  // A lens that was not seen to move may be at rest again.
  out.covariance(0, 0) += options_.least_sigma * options_.least_sigma;
  out.covariance(1, 1) += kRestingRate * kRestingRate;
  out.sensitivity = carry * state_.sensitivity;
  return out;
}

void LensTrack::learn(double time_s, bool moves, const State& predicted, const State& solved) {
  const double dt = std::abs(time_s - time_s_);
  time_s_ = time_s;
  if (moves || !rested_) {
    state_ = solved;
    // The first frame at rest still contains the movement.
    rested_ = !moves;
    return;
  }
  const double prior = predicted.covariance(0, 0);
  const double information = 1 / solved.covariance(0, 0) - 1 / prior;
  state_ = predicted;
  state_.covariance(0, 0) = prior;
  if (!(information > 0)) return;
  const double inflation = variance_inflation(kSharedCorrelation_s, dt);
  // Take this share of the solution's step.
  const double gain = prior * information / (inflation + prior * information);
  const double full = prior * information / (1 + prior * information);
  const double share = gain / full;
  state_.value[0] += share * (solved.value[0] - predicted.value[0]);
  state_.sensitivity.row(0) += share * (solved.sensitivity.row(0) - predicted.sensitivity.row(0));
  const double least = options_.least_sigma * options_.least_sigma;
  state_.covariance(0, 0) = std::max(least, prior * (1 - gain));
}

}  // namespace alidade

// OrientationStep, the part with the delay of the links: what motion shows of it, and what it adds
// to telemetry's covariance.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/model/mechanics.h"
#include "edge_app/step/frame_observations.h"
#include "edge_app/step/orientation_step.h"

namespace alidade {
namespace {

constexpr double kRecent_s = 0.3;    // an image that still tells how the head moves
constexpr double kSeenSigma = 1e-3;  // rad/s, of a rate from one image
constexpr double kMean_s = 0.1;      // of the rate over a while
constexpr double kBeginning =
    0.2;  // rad/s^2, one standard deviation, of a head that begins to move

// The variance of one axis has grown by `lasting`, which is the same in many frames: more frames do
// not average it out.
void note_lasting(double lasting, double variance, InterpolatedPanTilt* measured) {
  if (!(lasting > 0)) return;
  measured->correlation_time_s = std::max(
      measured->correlation_time_s, std::min(1.0, lasting / variance) * DelayWander::kMemory_s);
}

// A clock that wanders, as the query has it already. A time error t changes the rate by a t, with
// the acceleration a, and the angle in second order by a t^2 / 2.
void allow_for_lasting_error(double sigma_s, InterpolatedPanTilt* measured) {
  if (!(sigma_s > 0)) return;
  const double square = sigma_s * sigma_s;
  const Vector2<double> rate = measured->rate.vector();
  for (int axis = 0; axis < 2; ++axis) {
    double& variance = measured->covariance(axis, axis);
    const double before = variance;
    variance += measured->acceleration_square[axis] * square * square / 4;
    measured->covariance(2 + axis, 2 + axis) += measured->acceleration_square[axis] * square;
    note_lasting(square * rate[axis] * rate[axis], before, measured);
  }
}

// Rates that the head may have had when the picture was taken, for all that is known of the delay.
struct PossibleRates {
  Vector2<double> square = Vector2<double>::Zero();  // (rad/s)^2, the largest, without its noise
  Vector2<double> spread = Vector2<double>::Zero();  // (rad/s)^2, mean square about the look-up's
  bool moves = false;                                // beyond the noise

  void take(const Vector2<double>& rate, const Vector2<double>& variance) {
    constexpr double kSignificant = 16;
    const Vector2<double> squares = rate.cwiseAbs2();
    square = square.cwiseMax(squares - variance);
    moves = moves || (squares.array() > kSignificant * variance.array()).any();
  }
  void take(const InterpolatedPanTilt& measured) {
    take(measured.rate.vector(), measured.covariance.diagonal().tail<2>());
  }
};

PossibleRates possible_rates(const TelemetryIntake& telemetry, const InterpolatedPanTilt& measured,
                             double sigma_s) {
  constexpr double kSharp_s = 0.01;  // the rates of less are alike
  constexpr double kSigmas = 2.5;
  constexpr int kEachWay = 4;
  PossibleRates out;
  out.take(measured);
  if (sigma_s < kSharp_s) return out;
  int count = 0;
  for (int i = -kEachWay; i <= kEachWay; ++i) {
    InterpolatedPanTilt there;
    const double time_s = measured.time_s + kSigmas * sigma_s * i / kEachWay;
    if (i == 0 || !has_result(telemetry.query(time_s, 0, &there))) continue;
    out.take(there);
    const Vector2<double> differs = there.rate.vector() - measured.rate.vector();
    const Vector2<double> noise = there.covariance.diagonal().tail<2>();
    out.spread += (differs.cwiseAbs2() - noise).cwiseMax(Vector2<double>::Zero());
    ++count;
  }
  if (count > 0) out.spread /= count;
  return out;
}

}  // namespace

QueryStatus OrientationStep::ask_telemetry(double time_s, double time_sigma_s,
                                           InterpolatedPanTilt* out) const {
  const QueryStatus status = telemetry_.query(time_s, time_sigma_s, out);
  if (!has_result(status)) return status;
  allow_for_lasting_error(lasting_sigma_s_, out);
  const double sigma_s = link_delay_.sigma_s();
  if (!(sigma_s > 0)) return status;
  PossibleRates possible = possible_rates(telemetry_, *out, sigma_s);
  const double square = sigma_s * sigma_s;
  const Vector2<double> before = out->covariance.diagonal().head<2>();
  if (has_shown_ && std::abs(by_calibration_s_ - shown_.time_s) < kRecent_s) {
    const Vector2<double> seen = shown_.rate.vector();
    possible.take(seen, Vector2<double>::Constant(kSeenSigma * kSeenSigma));
    if (!possible.moves) {
      // At rest in the images as in the telemetry: the rate is as the images have it over a while.
      // In PT mode, whose records do not wait for the image, it may have begun to move since.
      const double since_s = turns_ ? by_calibration_s_ - shown_.time_s : 0;
      const double begun = kBeginning * since_s * since_s / 2;
      for (int axis = 0; axis < 2; ++axis) {
        const double variance = square * mean_rate_[axis] * mean_rate_[axis];
        out->covariance(axis, axis) += variance + begun * begun;
        note_lasting(variance, before[axis], out);
      }
      return status;
    }
    possible.spread = possible.spread.cwiseMax((seen - out->rate.vector()).cwiseAbs2());
  }
  const Vector2<double> rate = out->rate.vector();
  out->covariance.topLeftCorner<2, 2>() += square * rate * rate.transpose();
  for (int axis = 0; axis < 2; ++axis) {
    double& variance = out->covariance(axis, axis);
    variance += square * std::max(0.0, possible.square[axis] - rate[axis] * rate[axis]);
    out->covariance(2 + axis, 2 + axis) += possible.spread[axis];
    const double acceleration = out->acceleration_square[axis];
    variance += acceleration * square * square / 4;
    out->covariance(2 + axis, 2 + axis) += acceleration * square;
    note_lasting(variance - before[axis], variance, out);
  }
  return status;
}

void OrientationStep::show_motion() {
  if (!answered_by_oe_ || oe_->statistics().status != OeStatus::kOk) return;
  const OeStatistics& statistics = oe_->statistics();
  if (statistics.map != shown_map_) {
    shown_map_ = statistics.map;
    has_shown_ = false;
    link_delay_.break_images();
  }
  const Mechanics<double>& mechanics = now_.calibration.mechanics;
  show({by_calibration_s_, measured_from_true(mechanics, statistics.angle),
        measured_from_true(mechanics, statistics.rate)});
}

void OrientationStep::show(const ImageAngles& image) {
  const double elapsed_s = image.time_s - shown_.time_s;
  if (has_shown_ && elapsed_s > 0 && elapsed_s < kRecent_s) {
    const Vector2<double> rate = minus(image.angle, shown_.angle) / elapsed_s;
    mean_rate_ += std::min(1.0, elapsed_s / kMean_s) * (rate - mean_rate_);
  } else {
    mean_rate_ = image.rate.vector();
  }
  shown_ = image;
  has_shown_ = true;
  link_delay_.add(image);
}

void OrientationStep::follow_turn() {
  if (tracks_.tracker == FrameTracks::Tracker::kStartUp) {
    alidade::get_tracks(*start_up_, &tracks_);
  } else {
    tracks_.count = 0;
  }
  turns_->add(now_.calibration, tracks_);
  if (!turns_->angular_velocity()) {
    link_delay_.break_images();
    has_shown_ = false;
    return;
  }
  const Mechanics<double>& mechanics = now_.calibration.mechanics;
  Matrix<double, 3, 2> J;
  static_cast<void>(angular_velocity(mechanics, true_from_measured(mechanics, measured_angle_),
                                     PanTilt<double>{}, nullptr, &J));
  const Vector2<double> rate =
      (J.transpose() * J).inverse() * (J.transpose() * *turns_->angular_velocity());
  if (!all_finite(rate)) return;
  turned_ = {turned_.pan + turns_->step_s() * rate.x(), turned_.tilt + turns_->step_s() * rate.y()};
  // The turn's is the rate in its middle.
  const Vector2<double> at_end = has_shown_ ? Vector2<double>(1.5 * rate - 0.5 * turn_rate_) : rate;
  turn_rate_ = rate;
  show({by_calibration_s_, measured_from_true(mechanics, turned_),
        measured_from_true(mechanics, PanTilt<double>{at_end.x(), at_end.y()})});
}

void OrientationStep::tell_delay(StepEvents* events) {
  const bool was_open = delay_was_open_;
  delay_was_open_ = link_delay_.state() == LinkDelayState::kOpen;
  if (now_.calibrated) {
    events->link_delay = {link_delay_.state(), link_delay_.delay_s(), link_delay_.sigma_s()};
  }
  if (link_delay_.found() == delays_told_) return;
  delays_told_ = link_delay_.found();
  events->link_delay_told = now_.calibrated;
  // They would be looked up by the delay of before.
  if (oe_) oe_->forget_pending();
  if (!was_open) tracks_.delay_stepped = true;
}

}  // namespace alidade

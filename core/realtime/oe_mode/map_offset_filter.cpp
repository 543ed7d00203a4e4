#include "core/realtime/oe_mode/map_offset_filter.h"

#include "core/realtime/frame_orientation.h"

namespace alidade {

bool MapOffsetOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(max_contradiction > 0)) problem = "max_contradiction must be positive";
  if (!(shared_correlation_time_s >= 0)) problem = "shared_correlation_time_s must not be negative";
  if (!(drift >= 0)) problem = "drift must not be negative";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

bool MapOffset::learn(const Vector2<double>& innovation,
                      const Matrix2<double>& innovation_covariance,
                      const Sensitivity<2>& innovation_sensitivity, double max_chi_square) {
  const Matrix2<double> information = inverse_of(innovation_covariance + covariance);
  if (!(innovation.dot(information * innovation) < max_chi_square)) return false;
  const Matrix2<double> gain = covariance * information;
  value += gain * innovation;
  sensitivity += gain * innovation_sensitivity;
  covariance = (covariance - gain * covariance).eval();
  covariance = symmetric(covariance);
  return true;
}

void MapOffsetFilter::reset(const MapOffset& offset) {
  offset_ = offset;
  learnt_time_s_ = kNever;
  answered_time_s_ = kNever;
  contradicted_ = false;
  forget_pending();
}

double MapOffsetFilter::inflation(const InterpolatedPanTilt& telemetry, double frame_time_s) const {
  const double before_s = telemetry.extrapolated ? answered_time_s_ : learnt_time_s_;
  return variance_inflation(telemetry.correlation_time_s, frame_time_s - before_s);
}

void MapOffsetFilter::drift(double elapsed_s) {
  offset_.covariance.diagonal().array() += options_.drift * options_.drift * elapsed_s;
}

void MapOffsetFilter::begin(double frame_time_s, const Matrix2<double>& angle_covariance,
                            bool extrapolated) {
  offset_ = {Vector2<double>::Zero(), angle_covariance, Sensitivity<2>::Zero()};
  answered_time_s_ = frame_time_s;
  if (!extrapolated) learnt_time_s_ = frame_time_s;
}

bool MapOffsetFilter::learn(double frame_time_s, const OffsetInnovation& innovation) {
  const double inflation =
      variance_inflation(options_.shared_correlation_time_s, frame_time_s - learnt_time_s_);
  if (!offset_.learn(innovation.value,
                     innovation.covariance + inflation * innovation.shared_covariance,
                     innovation.sensitivity, options_.max_contradiction)) {
    return false;
  }
  learnt_time_s_ = frame_time_s;
  return true;
}

void MapOffsetFilter::add_pending(const PendingFrame& frame) {
  if (pending_count_ < kMaxPending) {
    ++pending_count_;
  } else {
    first_pending_ = (first_pending_ + 1) % kMaxPending;
  }
  pending_at(pending_count_ - 1) = frame;
}

const PendingFrame* MapOffsetFilter::enclosed(double newest_sample_s) const {
  const PendingFrame& oldest = pending_[first_pending_];
  return pending_count_ > 0 && oldest.look_up_time_s <= newest_sample_s ? &oldest : nullptr;
}

void MapOffsetFilter::settle_oldest(const Calibration& calibration,
                                    const InterpolatedPanTilt* late) {
  if (pending_count_ == 0) return;
  const PendingFrame& frame = pending_[first_pending_];
  first_pending_ = (first_pending_ + 1) % kMaxPending;
  --pending_count_;
  if (late == nullptr || late->extrapolated) return;
  const Mechanics<double>& mechanics = calibration.mechanics;
  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  const Matrix2<double> covariance =
      to_true.asDiagonal() * late->covariance.topLeftCorner<2, 2>() * to_true.asDiagonal();
  const FrameMotion<double> motion{true_from_measured(mechanics, late->angle),
                                   true_from_measured(mechanics, late->rate),
                                   0.5 * calibration.camera.height};
  OffsetInnovation innovation;
  innovation.value = minus(motion.angle, PanTilt<double>{frame.angle.x() + offset_.value.x(),
                                                         frame.angle.y() + offset_.value.y()});
  innovation.sensitivity = telemetry_sensitivity(mechanics, motion).topRows<2>() -
                           frame.sensitivity - offset_.sensitivity;
  const double inflation =
      variance_inflation(late->correlation_time_s, frame.frame_time_s - learnt_time_s_);
  innovation.covariance = frame.covariance + inflation * covariance;
  innovation.shared_covariance = frame.shared_covariance;
  if (!all_finite(innovation.value) || !all_finite(covariance)) return;
  contradicted_ = !learn(frame.frame_time_s, innovation);
}

}  // namespace alidade

#include "core/realtime/oe_mode/map_offset_filter.h"

#include "core/realtime/frame_orientation.h"

namespace alidade {

bool MapOffsetOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(max_contradiction > 0)) problem = "max_contradiction must be positive";
  if (!(shared_correlation_time_s >= 0)) problem = "shared_correlation_time_s must not be negative";
  if (!(lens_drift >= 0)) problem = "lens_drift must not be negative";
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

bool MapOffset::learn(const Vector2<double>& innovation,
                      const Matrix2<double>& innovation_covariance,
                      const Matrix2<double>& by_calibration,
                      const Sensitivity<2>& innovation_sensitivity, const Vector2<double>& by_lens,
                      double max_chi_square, LensScale* lens) {
  Matrix3<double> noise;                              // of (offset, phi)
  noise << covariance, lens->covariance_with_offset,  //
      lens->covariance_with_offset.transpose(), lens->variance;
  Matrix<double, 2, 3> H;
  H << Matrix2<double>::Identity(), by_lens;
  const Matrix<double, 3, 2> with_innovation = noise * H.transpose();
  const Matrix2<double> expected = H * with_innovation + innovation_covariance;
  const Vector2<double> left = innovation - by_lens * lens->value;
  if (!(left.dot(inverse_of((expected + by_calibration).eval()) * left) < max_chi_square)) {
    return false;
  }
  const Matrix2<double> information = inverse_of(expected);
  const Matrix<double, 3, 2> gain = with_innovation * information;
  const Sensitivity<2> of_left = innovation_sensitivity - by_lens * lens->sensitivity;
  value += gain.topRows<2>() * left;
  sensitivity += gain.topRows<2>() * of_left;
  lens->make_independent(&sensitivity);
  lens->value += gain.row(2).dot(left);
  lens->sensitivity += gain.row(2) * of_left;
  noise = symmetric<3>(noise - gain * with_innovation.transpose());
  covariance = noise.topLeftCorner<2, 2>();
  lens->covariance_with_offset = noise.topRightCorner<2, 1>();
  lens->variance = noise(2, 2);
  return true;
}

void MapOffsetFilter::reset(const MapOffset& offset) {
  offset_ = offset;
  learnt_time_s_ = kNever;
  answered_time_s_ = kNever;
  contradicted_ = false;
  lens_.covariance_with_offset.setZero();
  scale_learnt_time_s_ = kNever;
  forget_pending();
}

double MapOffsetFilter::inflation(const InterpolatedPanTilt& telemetry, double frame_time_s) const {
  const double before_s = telemetry.extrapolated ? answered_time_s_ : learnt_time_s_;
  return variance_inflation(telemetry.correlation_time_s, frame_time_s - before_s);
}

void MapOffsetFilter::drift(double elapsed_s) {
  offset_.covariance.diagonal().array() += options_.drift * options_.drift * elapsed_s;
  if (lens_.learnt) lens_.variance += options_.lens_drift * options_.lens_drift * elapsed_s;
}

void MapOffsetFilter::begin(double frame_time_s, const Matrix2<double>& angle_covariance,
                            bool extrapolated) {
  offset_ = {Vector2<double>::Zero(), angle_covariance, Sensitivity<2>::Zero()};
  lens_.covariance_with_offset.setZero();
  answered_time_s_ = frame_time_s;
  if (!extrapolated) learnt_time_s_ = frame_time_s;
}

bool MapOffsetFilter::learn(double frame_time_s, const OffsetInnovation& innovation) {
  const double inflation =
      variance_inflation(options_.shared_correlation_time_s, frame_time_s - learnt_time_s_);
  const Matrix2<double> covariance =
      innovation.covariance + inflation * innovation.shared_covariance;
  if (lens_.learnt ? !offset_.learn(innovation.value, covariance, innovation.by_calibration,
                                    innovation.sensitivity, innovation.by_lens,
                                    options_.max_contradiction, &lens_)
                   : !offset_.learn(innovation.value, covariance, innovation.sensitivity,
                                    options_.max_contradiction)) {
    return false;
  }
  learnt_time_s_ = frame_time_s;
  return true;
}

void MapOffsetFilter::learn_scale(double frame_time_s, double measurement, double information,
                                  const Sensitivity<1>& sensitivity) {
  if (!lens_.learnt || !(information > 0) || !std::isfinite(measurement)) return;
  lens_.learn(measurement, information / scale_inflation(frame_time_s), sensitivity, &offset_.value,
              &offset_.covariance, &offset_.sensitivity);
  scale_learnt_time_s_ = frame_time_s;
}

void MapOffsetFilter::move_lens(Calibration* calibration) {
  const double phi = lens_.value;
  for (std::size_t i = 0; i < pending_count_; ++i) {
    PendingFrame& frame = pending_at(i);
    frame.angle += phi * (frame.sensitivity * lens_.direction);
  }
  lens_.move_calibration(phi, calibration);
  lens_.make_independent(&offset_.sensitivity);
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
  innovation.by_calibration = frame.by_calibration;
  if (lens_.learnt) innovation.by_lens = frame.sensitivity * lens_.direction;
  if (!all_finite(innovation.value) || !all_finite(covariance)) return;
  contradicted_ = !learn(frame.frame_time_s, innovation);
}

}  // namespace alidade

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

AngleError angle_error(const Mechanics<double>& mechanics, const InterpolatedPanTilt& telemetry) {
  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  AngleError out;
  out.angle = true_from_measured(mechanics, telemetry.angle).vector();
  out.variance = to_true.cwiseAbs2().cwiseProduct(telemetry.error_variance);
  out.length = telemetry.error_length;
  return out;
}

void MapOffsetFilter::reset(const MapOffset& offset) {
  offset_ = offset;
  for (OffsetAxisCells& cells : cells_) cells.clear();
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

void MapOffsetFilter::widen(const Calibration& calibration, InterpolatedPanTilt* telemetry) const {
  const Vector2<double> scale(calibration.mechanics.pan_scale, calibration.mechanics.tilt_scale);
  for (int i = 0; i < 2; ++i) {
    const OffsetAxisCells& cells = cells_[static_cast<std::size_t>(i)];
    const double by = scale[i] * scale[i] * cells.learnt_variance();
    if (by == 0) continue;
    if (by > telemetry->error_variance[i]) telemetry->error_length[i] = cells.learnt_length();
    telemetry->error_variance[i] += by;
    telemetry->covariance(i, i) += by;
  }
}

AngleErrorShare MapOffsetFilter::share(const AngleError& error,
                                       const Vector2<double>& noise) const {
  AngleErrorShare out;
  out.variance = error.variance;
  for (int i = 0; i < 2; ++i) {
    const OffsetAxisCells::Expected expected = cells_[static_cast<std::size_t>(i)].expected(
        error.angle[i], error.variance[i], error.length[i]);
    const double by = 1 / (1 - expected.weight);
    out.repeated[i] = by * by * (noise[i] + expected.variance) - noise[i] - error.variance[i];
  }
  return out;
}

void MapOffsetFilter::drift(double elapsed_s) {
  offset_.covariance.diagonal().array() += options_.drift * options_.drift * elapsed_s;
  if (lens_.learnt) lens_.variance += options_.lens_drift * options_.lens_drift * elapsed_s;
}

void MapOffsetFilter::begin(double frame_time_s, const Matrix2<double>& angle_covariance,
                            bool extrapolated, const AngleError& error) {
  offset_ = {Vector2<double>::Zero(), angle_covariance, Sensitivity<2>::Zero()};
  for (OffsetAxisCells& cells : cells_) cells.clear();
  OffsetInnovation first;
  first.error = error;
  note_in_cells(frame_time_s, first, Vector2<double>::Zero(),
                angle_covariance.diagonal() - error.variance,
                angle_covariance.diagonal().cwiseInverse());
  lens_.covariance_with_offset.setZero();
  answered_time_s_ = frame_time_s;
  if (!extrapolated) learnt_time_s_ = frame_time_s;
}

Matrix2<double> MapOffsetFilter::noise_of(double frame_time_s,
                                          const OffsetInnovation& innovation) const {
  const double inflation =
      variance_inflation(options_.shared_correlation_time_s, frame_time_s - learnt_time_s_);
  return innovation.covariance + inflation * innovation.shared_covariance;
}

bool MapOffsetFilter::learn(double frame_time_s, const OffsetInnovation& innovation) {
  const Matrix2<double> covariance = noise_of(frame_time_s, innovation);
  const Vector2<double> before = offset_.covariance.diagonal();
  const Vector2<double> seen = offset_.value + innovation.value - lens_.value * innovation.by_lens;
  remember_seen(frame_time_s, innovation, seen, covariance);
  if (innovation.error.exists()
          ? !learn_beside_error(innovation, covariance)
          : !learn_offset(innovation, covariance, options_.max_contradiction)) {
    note_contradiction(frame_time_s, innovation);
    return false;
  }
  note_in_cells(frame_time_s, innovation, seen, covariance.diagonal(),
                offset_.covariance.diagonal().cwiseInverse() - before.cwiseInverse());
  learnt_time_s_ = frame_time_s;
  return true;
}

void MapOffsetFilter::note_contradiction(double frame_time_s, const OffsetInnovation& innovation) {
  const Vector2<double> left = innovation.value - lens_.value * innovation.by_lens;
  if (!(left.cwiseAbs().maxCoeff() < OffsetAxisCells::kLargestError_rad)) return;
  const Matrix2<double> covariance = noise_of(frame_time_s, innovation);
  remember_seen(frame_time_s, innovation, offset_.value + left, covariance);
  note_in_cells(frame_time_s, innovation, offset_.value + left, covariance.diagonal(),
                Vector2<double>::Zero());
}

void MapOffsetFilter::remember_seen(double frame_time_s, const OffsetInnovation& innovation,
                                    const Vector2<double>& offset,
                                    const Matrix2<double>& covariance) {
  constexpr double kUsualLength_rad = 0.05;  // of an error whose length is not known
  const AngleError& error = innovation.error;
  seen_.time_s = frame_time_s;
  seen_.angle = error.angle;
  seen_.offset = offset;
  seen_.variance = covariance.diagonal();
  for (int i = 0; i < 2; ++i) {
    const double length = error.length[i] > 0 ? error.length[i] : kUsualLength_rad;
    seen_.slope_sigma[i] = std::sqrt(std::max(0.0, error.variance[i])) / length;
  }
  has_seen_ = true;
}

bool MapOffsetFilter::take_seen(SeenOffset* out) {
  if (!has_seen_) return false;
  *out = seen_;
  has_seen_ = false;
  return true;
}

bool MapOffsetFilter::learn_offset(const OffsetInnovation& innovation,
                                   const Matrix2<double>& covariance, double max_chi_square) {
  if (lens_.learnt) {
    return offset_.learn(innovation.value, covariance, innovation.by_calibration,
                         innovation.sensitivity, innovation.by_lens, max_chi_square, &lens_);
  }
  return offset_.learn(innovation.value, covariance, innovation.sensitivity, max_chi_square);
}

// One Kalman step takes what was said near this angle from before to now: docs/oe_mode.md.
bool MapOffsetFilter::learn_beside_error(const OffsetInnovation& innovation,
                                         const Matrix2<double>& covariance) {
  const AngleError& error = innovation.error;
  const Vector2<double> left = innovation.value - lens_.value * innovation.by_lens;
  Matrix2<double> expected = covariance + offset_.covariance + innovation.by_calibration;
  expected.diagonal() += error.variance;
  if (!(left.dot(inverse_of(expected) * left) < options_.max_contradiction)) return false;
  OffsetInnovation step = innovation;
  Matrix2<double> of_step = covariance;
  for (int i = 0; i < 2; ++i) {
    const OffsetAxisCells::Expected g = cells_[static_cast<std::size_t>(i)].expected(
        error.angle[i], error.variance[i], error.length[i]);
    const double by = 1 / (1 - g.weight);
    step.value[i] += (by - 1) * (offset_.value[i] + left[i] - g.mean);
    of_step(i, i) += g.variance;
    of_step.row(i) *= by;
    of_step.col(i) *= by;
  }
  return learn_offset(step, of_step, std::numeric_limits<double>::infinity());
}

void MapOffsetFilter::note_in_cells(double frame_time_s, const OffsetInnovation& innovation,
                                    const Vector2<double>& offset, const Vector2<double>& variance,
                                    const Vector2<double>& used) {
  for (int i = 0; i < 2; ++i) {
    OffsetAxisCells& cells = cells_[static_cast<std::size_t>(i)];
    if (!(variance[i] > 0) || !std::isfinite(innovation.error.angle[i])) continue;
    cells.add({innovation.error.angle[i], offset[i], variance[i],
               std::isfinite(used[i]) ? std::max(0.0, used[i]) : 0,
               std::max(0.0, innovation.error.variance[i] - cells.learnt_variance()),
               innovation.calibration_variance[i], frame_time_s},
              options_.drift);
  }
  learn_error();
}

// Both axes are of one make: what one does not show, the other does.
void MapOffsetFilter::learn_error() {
  constexpr double kWorth = 4;  // degrees of freedom, of the other axis
  const std::array<OffsetAxisCells::Scatter, 2> own = {cells_[0].scatter(), cells_[1].scatter()};
  for (std::size_t i = 0; i < 2; ++i) {
    OffsetAxisCells::Scatter error = own[i];
    const OffsetAxisCells::Scatter& other = own[1 - i];
    if (error.freedom == 0 && other.freedom == 0) continue;
    if (other.variance > error.variance) {
      error.variance += kWorth / (kWorth + error.freedom) * (other.variance - error.variance);
      if (!(error.length > 0)) error.length = other.length;
    }
    const auto axis = static_cast<Eigen::Index>(i);
    cells_[i].take_error(error, &offset_.covariance(axis, axis));
  }
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
  const AngleError error = angle_error(mechanics, *late);
  Matrix2<double> covariance =
      to_true.asDiagonal() * late->covariance.topLeftCorner<2, 2>() * to_true.asDiagonal();
  covariance.diagonal() -= error.variance;
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
  innovation.error = error;
  innovation.calibration_variance = variance_by(calibration, innovation.sensitivity);
  if (!all_finite(innovation.value) || !all_finite(covariance)) return;
  contradicted_ = !learn(frame.frame_time_s, innovation);
}

}  // namespace alidade

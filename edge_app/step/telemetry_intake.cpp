#include "edge_app/step/telemetry_intake.h"

#include <algorithm>
#include <cmath>

namespace alidade {

TelemetryIntake::Samples TelemetryIntake::empty(bool filtered) const {
  // Filtered times share the error of their line. Polled times have an error each, which a bound
  // beyond every stamp's sigma expresses.
  constexpr double kAllOwn_s = 1e3;
  TelemetryNoise noise = options_.noise;
  noise.resolution = std::max(noise.resolution, resolution_);
  if (!filtered) noise.period_sigma_s = kAllOwn_s;
  return Samples(noise, options_.limits);
}

// During a stall a poll, or its answer, waits for long. Nobody knows when in that time the answer
// was true; nor how fast the head turned, if it is one of the first two samples, which give the
// rate.
bool TelemetryIntake::is_stalled_poll(const PanTiltSample& sample) {
  const double width_s = sample.latest_time_s - sample.earliest_time_s;
  const std::optional<double> newest_s = samples_.newest_time();
  const bool begins = samples_.size() < 2 ||
                      sample.latest_time_s > newest_s.value_or(0) + options_.limits.max_gap_s;
  const double longest_s = begins ? 0.02 : 0.1;  // no stall is shorter
  constexpr double kTimesTheUsual = 2.5;
  constexpr double kGrowth = 1.5;  // of the usual time, per poll: a device may be or become slow
  const bool stalled = width_s > std::max(longest_s, kTimesTheUsual * usual_poll_s_);
  usual_poll_s_ = width_s < usual_poll_s_ ? usual_poll_s_ + (width_s - usual_poll_s_) / 4
                                          : std::min(width_s, kGrowth * usual_poll_s_);
  return stalled;
}

TelemetryIntake::Taken TelemetryIntake::add(const PanTiltSample& sample) {
  Taken out;
  const std::optional<ClockEstimate> clock =
      clock_.update(sample.latest_time_s, sample.device_time_s, sample.sequence, sample.restarted);
  const bool filtered = clock.has_value();
  out.restarted = sample.restarted || filtered != filtered_ || (clock && clock->restarted);
  if (out.restarted) {
    samples_ = empty(filtered);
    filtered_ = filtered;
    measured_count_ = 0;
    first_.reset();
    age_.restart();
    last_stored_s_.reset();
    correction_.forget_state();
  }
  is_lost_ = false;

  TelemetrySample timed;
  timed.pan = sample.pan_rad;
  timed.tilt = sample.tilt_rad;
  const double width_s = sample.latest_time_s - sample.earliest_time_s;
  const bool line_holds = clock && clock->state == ClockState::kLocked;
  if (options_.leave_out_stalled && is_stalled_poll(sample) && !line_holds) return out;
  if (clock) {
    timed.time_s = clock->time_s;
    timed.time_sigma_s = clock->sigma_s;
  } else {
    timed.time_s = sample.latest_time_s - width_s / 2;
    timed.time_sigma_s = width_s > 0 ? width_s / std::sqrt(12.0) : options_.stamp_sigma_s;
    forget_old_first(timed);
  }
  step_.add(timed.pan, timed.tilt);
  const bool knows_age = !clock && age_.add(timed.time_s, timed.pan, timed.tilt);
  if (knows_age || resolution_shown() != resolution_) {
    resolution_ = resolution_shown();
    store_again();
  }
  measured_[measured_count_ % kMeasuredKept] = timed;
  ++measured_count_;
  const TelemetrySample corrected = store(timed);
  out.time_s = timed.time_s;
  InterpolatedPanTilt here;
  here.angle = out.angle = {corrected.pan, corrected.tilt};
  correction_.add_left(&here);
  out.error_variance = here.error_variance;
  return out;
}

// A later angle is new when it differs from the one before. The first may be as old as a device's
// angle can be that measures seldom, and would give a wrong rate. An angle that stands for longer is
// that of a head at rest.
void TelemetryIntake::forget_old_first(const TelemetrySample& next) {
  if (measured_count_ == 0) {
    first_ = next;
    return;
  }
  if (!first_ || (next.pan == first_->pan && next.tilt == first_->tilt)) return;
  if (next.time_s < first_->time_s + options_.limits.max_repeat_s) {
    samples_ = empty(filtered_);
    measured_count_ = 0;
    correction_.forget_state();
  }
  first_.reset();
}

TelemetrySample TelemetryIntake::store(const TelemetrySample& measured) {
  const std::optional<double> newest_s = samples_.newest_time();
  if (newest_s && measured.time_s > *newest_s + options_.limits.max_gap_s) {
    correction_.forget_state();
  }
  TelemetrySample corrected = measured;
  if (!filtered_ && last_stored_s_) {
    const double since_s = std::max(0.0, measured.time_s - *last_stored_s_);
    corrected.time_sigma_s = std::hypot(measured.time_sigma_s, age_.sigma_s(since_s));
  }
  last_stored_s_ = measured.time_s;
  correction_.correct(&corrected);
  static_cast<void>(samples_.push(corrected));
  return corrected;
}

void TelemetryIntake::correct_by(const Mechanics<double>& mechanics, const TelemetryError& error) {
  if (!error.exists() && !correction_.exists()) return;
  correction_ = TelemetryCorrection(mechanics, error, options_.noise.pan_tilt_sigma);
  store_again();
}

double TelemetryIntake::resolution_shown() const {
  constexpr double kDither = 0.25;
  if (options_.noise.resolution > 0) return options_.noise.resolution;
  const double step = step_.step();
  return options_.noise.pan_tilt_sigma < kDither * step ? step : 0;
}

void TelemetryIntake::store_again() {
  last_stored_s_.reset();
  correction_.forget_state();
  samples_ = empty(filtered_);
  const std::size_t kept = std::min(measured_count_, kMeasuredKept);
  for (std::size_t i = measured_count_ - kept; i < measured_count_; ++i) {
    store(measured_[i % kMeasuredKept]);
  }
}

}  // namespace alidade

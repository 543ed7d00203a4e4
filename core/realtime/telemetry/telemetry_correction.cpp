#include "core/realtime/telemetry/telemetry_correction.h"

namespace alidade {

TelemetryCorrection::TelemetryCorrection(const Mechanics<double>& mechanics,
                                         const TelemetryError& error, double noise_rad)
    : exists_(error.exists()), noise_rad_(noise_rad) {
  pan_.scale = mechanics.pan_scale;
  pan_.curve = error.pan;
  pan_.play = PlayOfReadings(error.pan_play);
  tilt_.scale = mechanics.tilt_scale;
  tilt_.curve = error.tilt;
  tilt_.play = PlayOfReadings(error.tilt_play);
}

// The same reading again is the same angle, so that a device's repeats stay repeats.
void TelemetryCorrection::Axis::take(double measured, double noise) {
  if (begun && measured == reading) return;
  const double m = true_from_measured(scale, curve, measured);
  const PlayedAngle played = play.next(m, noise);
  // The curve is over the true angle.
  const double angle = played.angle + (curve.at(m) - curve.at(played.angle)) / scale;
  begun = true;
  reading = measured;
  by_play = m - played.angle;
  off = measured - scale * angle;
  play_sigma = scale * played.sigma_rad;
}

double TelemetryCorrection::Axis::late(double measured) const {
  return measured - scale * (true_from_measured(scale, curve, measured) - by_play);
}

void TelemetryCorrection::Axis::add_left(int row, InterpolatedPanTilt* measured) const {
  const PanTilt<double>& angle = measured->angle;
  const double sigma = curve.sigma((row == 0 ? angle.pan : angle.tilt) / scale);
  const double variance = sigma * sigma + play_sigma * play_sigma;
  measured->error_variance[row] = variance;
  measured->error_length[row] = curve.length_rad;
  measured->covariance(row, row) += variance;
  if (!(curve.length_rad > 0)) return;
  // The slope of what is left is independent of its value, with sigma / length.
  const double rate = row == 0 ? measured->rate.pan : measured->rate.tilt;
  const double of_rate = sigma * rate / curve.length_rad;
  measured->covariance(2 + row, 2 + row) += of_rate * of_rate;
}

void TelemetryCorrection::correct(TelemetrySample* sample) {
  if (!exists_ || !std::isfinite(sample->pan) || !std::isfinite(sample->tilt)) return;
  if (begun_ && sample->time_s < newest_s_) {
    sample->pan -= pan_.late(sample->pan);
    sample->tilt -= tilt_.late(sample->tilt);
    return;
  }
  begun_ = true;
  newest_s_ = sample->time_s;
  pan_.take(sample->pan, noise_rad_);
  tilt_.take(sample->tilt, noise_rad_);
  sample->pan -= pan_.off;
  sample->tilt -= tilt_.off;
}

void TelemetryCorrection::forget_state() {
  begun_ = false;
  for (Axis* axis : {&pan_, &tilt_}) {
    axis->begun = false;
    axis->play.forget();
  }
}

void TelemetryCorrection::add_left(InterpolatedPanTilt* measured) const {
  measured->error_variance.setZero();
  measured->error_length.setZero();
  if (!exists_) return;
  pan_.add_left(0, measured);
  tilt_.add_left(1, measured);
}

}  // namespace alidade

#pragma once
// TelemetryCorrection: subtracts the known errors of telemetry's angles (telemetry_error.h) from
// the samples before they are interpolated, and adds the variance of the remaining errors to the
// covariance of interpolated angles. phi is the true angle, m the angle at the other side of the
// play, g the error curve:
//   corrected = scale phi,   phi = play(m),   scale m + g(phi) = measured
// Play has a state, so samples come in order of time. The state is unknown at first and after each
// forget_state(). Fixed memory; no allocation. One thread.

#include "core/model/telemetry_error.h"
#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {

class TelemetryCorrection {
 public:
  // Corrects nothing.
  TelemetryCorrection() = default;
  // noise_rad: sigma of a single angle.
  TelemetryCorrection(const Mechanics<double>& mechanics, const TelemetryError& error,
                      double noise_rad);

  [[nodiscard]] bool exists() const { return exists_; }
  // A sample with an angle that is not finite stays as it is. A sample older than an earlier one
  // does not move the state of the play.
  void correct(TelemetrySample* sample);
  // Samples were lost, or the head was switched off.
  void forget_state();
  // Adds the variance of the remaining error to the covariance, and sets error_variance and
  // error_length: 0 if nothing is corrected.
  void add_left(InterpolatedPanTilt* measured) const;

 private:
  struct Axis {
    double scale = 1;
    AngleErrorCurve curve;
    PlayOfReadings play;
    bool begun = false;
    double reading = 0;  // rad, of the newest sample
    double off = 0;      // rad, reading minus corrected
    double by_play = 0;  // rad, m minus phi
    double play_sigma = 0;

    void take(double measured, double noise_rad);
    [[nodiscard]] double late(double measured) const;
    void add_left(int row, InterpolatedPanTilt* measured) const;
  };

  bool exists_ = false;
  double noise_rad_ = 0;
  bool begun_ = false;
  double newest_s_ = 0;
  Axis pan_;
  Axis tilt_;
};

}  // namespace alidade

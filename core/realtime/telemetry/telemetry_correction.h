#pragma once
// TelemetryCorrection: takes what is known of the error of telemetry's angles (telemetry_error.h)
// out of the samples, before they are interpolated, and says of interpolated angles what is left:
//   corrected = scale phi,   phi = play(m),   scale m + g(phi) = measured
// Samples in order of time; play's state goes with them. It is unknown at first and after each
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
  // A sample that is older than one before does not move play's state.
  void correct(TelemetrySample* sample);
  // Samples were lost, or the head was switched off.
  void forget_state();
  // Adds what is left to the covariance.
  void add_left(InterpolatedPanTilt* measured) const;

 private:
  struct Axis {
    double scale = 1;
    AngleErrorCurve curve;
    PlayOfReadings play;
    bool begun = false;
    double reading = 0;  // rad, of the newest sample
    double off = 0;      // rad, reading minus corrected
    double by_play = 0;  // rad, of it
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

#pragma once
// TelemetryIntake: puts pan/tilt samples into a buffer that frames query (telemetry_buffer.h). A
// sample's time comes from the clock of its stamps (capture_clock.h), else from its poll. The
// buffer is emptied when the connection or the clock restarts, and when the times change from one
// of these kinds to the other. Known errors of the angles are subtracted (telemetry_correction.h).
// Fixed memory; no allocation. One thread.

#include <array>
#include <cstddef>
#include <optional>

#include "core/model/clock_filter.h"
#include "core/realtime/telemetry/angle_step.h"
#include "core/realtime/telemetry/renewal_age.h"
#include "core/realtime/telemetry/telemetry_buffer.h"
#include "core/realtime/telemetry/telemetry_correction.h"
#include "edge_app/clocks/capture_clock.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct TelemetryIntakeOptions {
  ClockFilterOptions clock;
  // s, one standard deviation of a receive time that is used as the capture time.
  double stamp_sigma_s = 5e-3;
  // Its period_sigma_s applies to filtered times only. resolution 0: found from the readings.
  TelemetryNoise noise;
  TelemetryLimits limits;
  // True: samples of stalled polls are left out, as it is not known when they were true, unless a
  // locked clock gives their time.
  bool leave_out_stalled = false;
};

class TelemetryIntake {
 public:
  explicit TelemetryIntake(const TelemetryIntakeOptions& options)
      : options_(options),
        clock_(options.clock),
        resolution_(options.noise.resolution),
        samples_(empty(false)),
        age_(RenewalAge::least_turn(options.noise.pan_tilt_sigma, options.noise.resolution),
             options.limits.max_repeat_s) {}

  struct Taken {
    bool restarted = false;        // earlier times cannot be asked for any more
    std::optional<double> time_s;  // telemetry time; empty: the sample is left out
    // Set if there is a time. angle: rad, measured units, without the known errors of the angles.
    // error_variance: rad^2, variance of what is left of these errors (pan, tilt).
    PanTilt<double> angle;
    Vector2<double> error_variance = Vector2<double>::Zero();
  };
  Taken add(const PanTiltSample& sample);
  // The connection was lost. The next sample ends that state.
  void note_lost() {
    is_lost_ = true;
    correction_.forget_state();
  }
  // Subtracts these errors of the angles from now on, and from the latest samples.
  void correct_by(const Mechanics<double>& mechanics, const TelemetryError& error);
  [[nodiscard]] bool is_lost() const { return is_lost_; }

  // See TelemetryBuffer.
  [[nodiscard]] QueryStatus query(double time_s, double time_sigma_s,
                                  InterpolatedPanTilt* out) const {
    const QueryStatus status = samples_.query(time_s, time_sigma_s, out);
    if (has_result(status)) correction_.add_left(out);
    return status;
  }
  [[nodiscard]] std::optional<double> newest_time() const { return samples_.newest_time(); }

 private:
  static constexpr std::size_t kSamplesKept = 1024;
  using Samples = TelemetryBuffer<kSamplesKept>;
  // The latest samples as measured: more than frames that wait ask for.
  static constexpr std::size_t kMeasuredKept = 256;

  [[nodiscard]] Samples empty(bool filtered) const;
  [[nodiscard]] bool is_stalled_poll(const PanTiltSample& sample);
  // Empties the buffer at the first change of the angles, if what came before may be too old.
  void forget_old_first(const TelemetrySample& next);
  // Corrects a sample, puts it into the buffer, and returns it. The buffer counts the samples that
  // it refuses (a duplicate, a value that is not finite); the records' sigma shows the effect.
  TelemetrySample store(const TelemetrySample& measured);
  // Fills the buffer anew with the latest samples as measured.
  void store_again();
  // rad. White noise of a quarter of a step or more dithers the readings: the result is then 0.
  [[nodiscard]] double resolution_shown() const;

  TelemetryIntakeOptions options_;
  CaptureClock clock_;
  double resolution_;  // rad, in use
  Samples samples_;
  TelemetryCorrection correction_;
  AngleStep step_;
  RenewalAge age_;                       // of polled samples
  std::optional<double> last_stored_s_;  // the time of the last sample that was put into the buffer
  std::array<TelemetrySample, kMeasuredKept> measured_{};  // ring buffer
  std::size_t measured_count_ = 0;                         // since the buffer was emptied
  std::optional<TelemetrySample> first_;  // of polled samples, until the angles change
  bool filtered_ = false;                 // the times in samples_ come from clock_
  bool is_lost_ = false;
  double usual_poll_s_ = 0.01;  // s, from a poll to its answer
};

}  // namespace alidade

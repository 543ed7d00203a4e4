#pragma once
// TelemetryIntake: pan/tilt samples as they come, with the time of their clock (capture_clock.h) or
// of their poll, in a buffer that frames query (telemetry_buffer.h). It is emptied when the
// connection or the clock restarts, or the times begin to be of the other kind. Fixed memory; no
// allocation. One thread.

#include <optional>

#include "core/model/clock_filter.h"
#include "core/realtime/telemetry/telemetry_buffer.h"
#include "edge_app/clocks/capture_clock.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct TelemetryIntakeOptions {
  ClockFilterOptions clock;
  // s, one standard deviation of a receive time that is used as the capture time.
  double stamp_sigma_s = 5e-3;
  // Its period_sigma_s applies to filtered times only.
  TelemetryNoise noise;
  TelemetryLimits limits;
  // True: samples of stalled polls are left out, as nobody knows when they were true, unless a
  // locked clock tells it.
  bool leave_out_stalled = false;
};

class TelemetryIntake {
 public:
  explicit TelemetryIntake(const TelemetryIntakeOptions& options)
      : options_(options), clock_(options.clock), samples_(empty(false)) {}

  struct Taken {
    bool restarted = false;        // earlier times cannot be asked for any more
    std::optional<double> time_s;  // telemetry time; empty: the sample is left out
  };
  Taken add(const PanTiltSample& sample);
  // The connection was lost. The next sample ends that state.
  void note_lost() { is_lost_ = true; }
  [[nodiscard]] bool is_lost() const { return is_lost_; }

  // See TelemetryBuffer.
  [[nodiscard]] QueryStatus query(double time_s, double time_sigma_s,
                                  InterpolatedPanTilt* out) const {
    return samples_.query(time_s, time_sigma_s, out);
  }
  [[nodiscard]] std::optional<double> newest_time() const { return samples_.newest_time(); }

 private:
  static constexpr std::size_t kSamplesKept = 1024;
  using Samples = TelemetryBuffer<kSamplesKept>;

  [[nodiscard]] Samples empty(bool filtered) const;
  [[nodiscard]] bool is_stalled_poll(const PanTiltSample& sample);

  TelemetryIntakeOptions options_;
  CaptureClock clock_;
  Samples samples_;
  bool filtered_ = false;  // the times in samples_ come from clock_
  bool is_lost_ = false;
  double usual_poll_s_ = 0.01;  // s, from a poll to its answer
};

}  // namespace alidade

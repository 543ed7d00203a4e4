#pragma once
// UtcLine: the age of pictures after a reconnection, where the sender's clock has restarted, by the
// sender's absolute clock (FrameStamp::sender_utc_s: ONVIF's capture time in each packet, or RTCP's
// reports). Beyond PTCEE.
//   before   host time = line(sender), sender = utc - ahead     as last seen on the old connection
//   after    time = line(utc - ahead), late = receive - time
// Only an age near zero (kAgrees_s) is trusted: an absolute clock may be set, and reports may be
// nonsense. Sigma includes `late`, the line's sigma and the delays' own. When line and `ahead` are
// used: docs/derivations.md. Seconds. Fixed memory, no allocation, one thread.

#include <cmath>
#include <optional>

#include "core/model/clock_filter.h"
#include "platform/streams/frame.h"

namespace alidade {

class UtcLine {
 public:
  static constexpr double kAgrees_s = 0.02;  // least delays of two connections differ by less

  struct Age {
    double time_s = 0;   // by the line of the connection before
    double sigma_s = 0;  // of time_s, if the age agrees
    double late_s = 0;   // receive time minus time_s
    [[nodiscard]] bool agrees() const { return std::abs(late_s) <= kAgrees_s; }
  };

  // To be called for each frame with a sender's clock, in order of arrival.
  void watch(const FrameStamp& stamp) {
    if (!tells(stamp)) return;
    const double ahead_s = *stamp.sender_utc_s - *stamp.sender_time_s;
    if (!steady_since_s_ || !(std::abs(ahead_s - steady_ahead_s_) <= kSteady_s)) {
      if (steady_since_s_) kept_.reset();
      steady_since_s_ = stamp.receive_time_s;
      steady_ahead_s_ = ahead_s;
    }
    ahead_s_ = ahead_s;
    seen_s_ = stamp.receive_time_s;
  }

  // The connection has ended. filter: the filter with its line; null if no line is to be believed.
  // off_line_s: s, how far frames lay off the line.
  void end_connection(const ClockFilter<>* filter, double off_line_s) {
    if (filter != nullptr && filter->state() == ClockState::kLocked && steady_since_s_ &&
        seen_s_ - *steady_since_s_ >= kProven_s) {
      kept_ = Kept{*filter, ahead_s_, off_line_s};
    }
    steady_since_s_.reset();
  }

  // Forgets the line that was kept: it is wrong, or of another connection.
  void forget() {
    kept_.reset();
    steady_since_s_.reset();
  }

  // For a frame of a later connection. Empty: nothing is known.
  [[nodiscard]] std::optional<Age> age(const FrameStamp& stamp) const {
    if (!kept_ || !tells(stamp)) return std::nullopt;
    const ClockFilter<>& filter = kept_->filter;
    const double sender_s = *stamp.sender_utc_s - kept_->ahead_s;
    const double line_sigma_s = std::hypot(filter.sigma(sender_s), kept_->off_line_s);
    if (!(line_sigma_s <= kSharp_s)) return std::nullopt;
    Age age;
    age.time_s = filter.to_host(sender_s);
    age.late_s = stamp.receive_time_s - filter.delay_shift_s() - age.time_s;
    age.sigma_s = std::hypot(std::hypot(line_sigma_s, filter.jitter_s()), age.late_s);
    return age;
  }

 private:
  static constexpr double kSteady_s = 5e-3;
  // A rate that is off by more than 5e-4 does not hold for this long.
  static constexpr double kProven_s = 10;
  static constexpr double kSharp_s = 5e-3;

  struct Kept {
    ClockFilter<> filter;
    double ahead_s = 0;
    double off_line_s = 0;
  };

  [[nodiscard]] static bool tells(const FrameStamp& stamp) {
    return stamp.sender_time_s && stamp.sender_utc_s && std::isfinite(*stamp.sender_utc_s);
  }

  std::optional<Kept> kept_;
  std::optional<double> steady_since_s_;  // receive time
  double steady_ahead_s_ = 0;
  double ahead_s_ = 0;
  double seen_s_ = 0;
};

}  // namespace alidade

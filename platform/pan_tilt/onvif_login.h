#pragma once
// OnvifLoginWays: in which ways a login at an ONVIF device is tried, in which order, and which was
// good.
//
// A WS-UsernameToken names the time of its creation, which the device holds against a clock: the
// one that it tells as UTC; or the true time, where what it tells as UTC is its local time; or the
// local time that it tells besides. Other devices want HTTP digest, and offer it. Devices lock a
// user out after three to five wrong logins: at most kMostTries differ in one go, no clock is tried
// twice, and where a login was good before, one is tried after each pause (HttpPollingSource), and
// each way twice: the clock may have been set.

#include <optional>
#include <string>
#include <vector>

#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

class OnvifLoginWays {
 public:
  enum class Way { kDeviceClock, kHostClock, kLocalClock, kDigest };
  static constexpr int kMostTries = 3;

  // What the device tells of its clock; none: nothing. Both times are those of the answer.
  void set_clock(const std::optional<OnvifClock>& told, double monotonic_s, double utc_s);

  [[nodiscard]] Way way() const { return way_; }
  // For a token at this time; not of kDigest. utc_s: of the host.
  [[nodiscard]] double created_utc_s(double monotonic_s, double utc_s) const;

  // The login was refused. True: another way is to be tried at once.
  [[nodiscard]] bool refused(bool offers_digest);
  // It was good, now at the latest.
  void accepted();
  [[nodiscard]] bool was_good() const { return good_.has_value(); }

  // "; tried by ..." where by more than one clock.
  [[nodiscard]] std::string tried_text() const { return tried_text_; }
  // What the device does otherwise than the standard says; empty: nothing.
  [[nodiscard]] std::string note() const;

 private:
  [[nodiscard]] std::optional<double> lead_s(Way way) const;
  [[nodiscard]] bool is_new(Way way) const;
  [[nodiscard]] std::optional<Way> next_way() const;
  [[nodiscard]] std::string text_of(Way way) const;

  Way way_ = Way::kDeviceClock;
  std::optional<Way> good_;
  std::vector<Way> tried_;      // refused since a login was good, or since the last go
  bool offers_digest_ = false;  // in one of the refusals
  bool again_ = false;          // way_ was refused once since it was good
  std::string tried_text_;
  bool tells_utc_ = true;  // the device; else at most a local time
  // The clocks that the device tells, less the host's monotonic one and less its UTC.
  std::optional<double> device_minus_monotonic_s_;
  std::optional<double> local_minus_monotonic_s_;
  double utc_minus_monotonic_s_ = 0;
};

}  // namespace alidade

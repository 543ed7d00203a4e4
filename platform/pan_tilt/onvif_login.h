#pragma once
// OnvifLoginWays: the ways to log in at an ONVIF device, their order, and the one that works.
//
// A WS-UsernameToken holds the time of its creation. The device compares this time with a clock:
// the clock that the device reports as UTC; or the true time, if the device reports its local time
// as UTC; or the local time that the device reports besides. Other devices want HTTP digest, and
// offer it. Devices lock a user out after three to five wrong logins. Therefore at most kMostTries
// ways are tried in one go, and no clock twice. If a login was accepted before, one attempt follows
// each pause (HttpPollingSource), two for each way: the device's clock may have been set.

#include <optional>
#include <string>
#include <vector>

#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

class OnvifLoginWays {
 public:
  // kDeviceClock: the UTC that the device reports, or its local time if it reports no UTC.
  enum class Way { kDeviceClock, kHostClock, kLocalClock, kDigest };
  static constexpr int kMostTries = 3;

  // told: the clock that the device reports; nullopt: none. monotonic_s (CLOCK_MONOTONIC), utc_s
  // (Unix time): the host's clocks, s, when the answer came.
  void set_clock(const std::optional<OnvifClock>& told, double monotonic_s, double utc_s);

  [[nodiscard]] Way way() const { return way_; }
  // Creation time for a token, s, Unix time; not for kDigest. monotonic_s, utc_s: the host's clocks
  // now, s.
  [[nodiscard]] double created_utc_s(double monotonic_s, double utc_s) const;

  // The login was refused. True: try way(), which is another one now, at once. False: nothing is
  // left to try, or a login was accepted before; the next attempt is by way(), after a pause.
  [[nodiscard]] bool refused(bool offers_digest);
  // The login was accepted.
  void accepted();
  [[nodiscard]] bool was_good() const { return good_.has_value(); }

  // "; tried by ..." if more than one clock was tried, else empty.
  [[nodiscard]] std::string tried_text() const { return tried_text_; }
  // How the device deviates from the standard; empty if it does not.
  [[nodiscard]] std::string note() const;

 private:
  [[nodiscard]] std::optional<double> lead_s(Way way) const;
  [[nodiscard]] bool is_new(Way way) const;
  [[nodiscard]] std::optional<Way> next_way() const;
  [[nodiscard]] std::string text_of(Way way) const;

  Way way_ = Way::kDeviceClock;
  std::optional<Way> good_;
  std::vector<Way> tried_;      // refused since a login was accepted, or since the last go
  bool offers_digest_ = false;  // in one of the refusals
  bool again_ = false;          // way_ was refused once since it was accepted
  std::string tried_text_;
  bool tells_utc_ = true;  // the device reports UTC, not only a local time
  // s; the clocks that the device reports, minus the host's monotonic clock.
  std::optional<double> device_minus_monotonic_s_;
  std::optional<double> local_minus_monotonic_s_;
  double utc_minus_monotonic_s_ = 0;
};

}  // namespace alidade

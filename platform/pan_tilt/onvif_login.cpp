#include "platform/pan_tilt/onvif_login.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

// s; clocks that differ by less count as equal: devices report whole seconds and accept tokens that
// are some seconds old.
constexpr double kSameClock_s = 3;

std::string lead_text(double lead_s) {
  const double size_s = std::abs(lead_s);
  return (size_s < 90 ? std::to_string(std::llround(size_s)) + " s "
                      : std::to_string(std::llround(size_s / 60)) + " min ") +
         (lead_s < 0 ? "behind" : "ahead of");
}

}  // namespace

void OnvifLoginWays::set_clock(const std::optional<OnvifClock>& told, double monotonic_s,
                               double utc_s) {
  const auto less_monotonic = [monotonic_s](const std::optional<double>& time_s) {
    return time_s ? std::optional(*time_s - monotonic_s) : std::nullopt;
  };
  const OnvifClock clock = told.value_or(OnvifClock());
  tells_utc_ = clock.utc_s.has_value();
  device_minus_monotonic_s_ = less_monotonic(clock.utc_s ? clock.utc_s : clock.local_s);
  local_minus_monotonic_s_ = less_monotonic(clock.local_s);
  utc_minus_monotonic_s_ = utc_s - monotonic_s;
  if (way_ == Way::kDeviceClock && !device_minus_monotonic_s_) {
    way_ = Way::kHostClock;  // best guess
  } else if (!good_ && tried_.empty() && way_ == Way::kHostClock && device_minus_monotonic_s_) {
    way_ = Way::kDeviceClock;
  }
}

double OnvifLoginWays::created_utc_s(double monotonic_s, double utc_s) const {
  const std::optional<double> offset_s = way_ == Way::kDeviceClock  ? device_minus_monotonic_s_
                                         : way_ == Way::kLocalClock ? local_minus_monotonic_s_
                                                                    : std::nullopt;
  return offset_s ? monotonic_s + *offset_s : utc_s;
}

// Lead of the way's clock over the host's UTC; nullopt: the device does not report it.
std::optional<double> OnvifLoginWays::lead_s(Way way) const {
  const auto less_utc = [this](const std::optional<double>& offset_s) {
    return offset_s ? std::optional(*offset_s - utc_minus_monotonic_s_) : std::nullopt;
  };
  switch (way) {
    case Way::kDeviceClock:
      return less_utc(device_minus_monotonic_s_);
    case Way::kLocalClock:
      return less_utc(local_minus_monotonic_s_);
    case Way::kHostClock:
      return 0;
    case Way::kDigest:
      break;
  }
  return std::nullopt;
}

// True if neither this way nor a token with the same time was tried.
bool OnvifLoginWays::is_new(Way way) const {
  const std::optional<double> mine_s = lead_s(way);
  return std::none_of(tried_.begin(), tried_.end(), [&](Way other) {
    const std::optional<double> other_s = lead_s(other);
    return other == way || (mine_s && other_s && std::abs(*mine_s - *other_s) < kSameClock_s);
  });
}

std::optional<OnvifLoginWays::Way> OnvifLoginWays::next_way() const {
  if (tried_.size() >= kMostTries) {
    return std::nullopt;
  }
  if (offers_digest_ && is_new(Way::kDigest)) {
    return Way::kDigest;
  }
  for (const Way way : {Way::kDeviceClock, Way::kHostClock, Way::kLocalClock}) {
    if (lead_s(way) && is_new(way)) {
      return way;
    }
  }
  return std::nullopt;
}

bool OnvifLoginWays::refused(bool offers_digest) {
  offers_digest_ = offers_digest_ || offers_digest;
  if (good_ && !again_) {
    again_ = true;
    return false;
  }
  again_ = false;
  tried_.push_back(way_);
  if (const std::optional<Way> next = next_way()) {
    way_ = *next;
    return !good_;
  }
  tried_text_.clear();
  const auto tokens =
      std::count_if(tried_.begin(), tried_.end(), [](Way way) { return way != Way::kDigest; });
  for (std::size_t i = 0; tokens > 1 && i < tried_.size(); ++i) {
    tried_text_ += (i == 0 ? "; tried by " : ", ") + text_of(tried_[i]);
  }
  way_ = good_.value_or(tried_.front());
  tried_.clear();
  return false;
}

void OnvifLoginWays::accepted() {
  good_ = way_;
  again_ = false;
  tried_.clear();
  tried_text_.clear();
}

std::string OnvifLoginWays::text_of(Way way) const {
  switch (way) {
    case Way::kDeviceClock:
      return std::string(tells_utc_ ? "the clock that it reports ("
                                    : "the local time that it reports (") +
             lead_text(lead_s(way).value_or(0)) + " this host's)";
    case Way::kHostClock:
      return "this host's clock";
    case Way::kLocalClock:
      return "the local time that it reports";
    case Way::kDigest:
      break;
  }
  return "HTTP digest";
}

std::string OnvifLoginWays::note() const {
  const std::optional<double> told_s = lead_s(Way::kDeviceClock);
  if (good_ == Way::kHostClock && told_s && std::abs(*told_s) >= kSameClock_s) {
    if (!tells_utc_) {
      return "the device reports a local time and no UTC, but accepts logins by this host's clock "
             "only; that clock is used for logins";
    }
    return "the device reports a UTC " + lead_text(*told_s) +
           " this host's, but accepts logins by this host's clock only; is its UTC really its "
           "local time? This host's clock is used for logins";
  }
  if (good_ == Way::kLocalClock) {
    return "the device accepts logins by its local time only, not by the UTC that it reports; its "
           "local time is used for logins";
  }
  return {};
}

}  // namespace alidade

#pragma once
// open_onvif(): polls an ONVIF device for its pan, tilt and zoom (PTZ service, GetStatus) over one
// kept HTTP connection. Pace, stamps and threads: http_polling_source.h.
//
// At each (re)connection it asks for the device's clock (if it has to log in), for its services
// (GetCapabilities), and for a profile with PTZ if none is configured. A service's address is used
// as told if it names the host of `url`; otherwise (a device behind a router) only its path is.
// - Login: a WS-UsernameToken created on the device's clock, and HTTP digest from the first 401 on
//   that offers it.
// - Angles: SphericalPositionSpaceDegrees as they are; the generic space -1..1 by the ranges.
// - device_time_s: UtcTime as Unix time, if it changes sensibly (device_clock_trial.h). The first
//   answers of a source's life are withheld until that is known: all its samples have it, or none.
// kDisconnected: unreachable, timed out, a SOAP fault, HTTP status other than 200, an answer that is
// no position. kFailed: unusable URL; until the first sample also wrong user or password, generic space
// without ranges. Later a refused login may be that of a device whose clock was set.

#include <memory>
#include <optional>
#include <string>

#include "platform/pan_tilt/http_polling_source.h"

namespace alidade {

// Linear map of the generic space; swapped values turn the sign.
struct OnvifRange {
  double at_minus_one_rad = 0;
  double at_plus_one_rad = 0;
};

// url: http://host[:port][/onvif/device_service]. pan and tilt: of the angle, after the range.
struct OnvifSourceOptions : HttpDeviceOptions {
  OnvifSourceOptions() { rate_hz = 10; }  // SOAP is work for a camera

  std::string profile;  // token; empty: the device's first profile with PTZ
  std::optional<OnvifRange> pan_range;
  std::optional<OnvifRange> tilt_range;
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_onvif(const OnvifSourceOptions& options);

}  // namespace alidade

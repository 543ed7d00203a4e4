#pragma once
// open_onvif(): polls an ONVIF device for its pan, tilt and zoom (PTZ service, GetStatus) over one
// kept HTTP connection. Pace, stamps and threads: http_polling_source.h.
//
// At each (re)connection it asks for the device's clock (if it has to log in), for its services
// (GetCapabilities, or GetServices), for a profile with PTZ if none is configured, and for the
// range of its positions (GetNodes, or GetConfigurationOptions) if they are not in degrees.
// - Services: only at the host of `url`, where the device says, or else where usual: onvif_addresses.h.
// - Login: a WS-UsernameToken by the clock that the device tells, or another, or HTTP digest where it is
//   offered: onvif_login.h.
// - Angles: onvif_scale.h.
// - device_time_s: UtcTime as Unix time, if it changes sensibly (device_clock_trial.h). The first
//   answers of a source's life are withheld until that is known: all its samples have it, or none.
// kDisconnected: unreachable, timed out, a SOAP fault, HTTP status other than 200, an answer that is
// no position. kFailed: unusable URL; until the first sample also wrong user or password, a scale
// without angles. Later a refused login may be that of a device that restarts or whose clock was
// set.

#include <memory>
#include <optional>
#include <string>

#include "platform/pan_tilt/http_polling_source.h"
#include "platform/pan_tilt/onvif_scale.h"

namespace alidade {

// url: http://host[:port][/onvif/device_service]. pan and tilt: of the angle, after the range.
struct OnvifSourceOptions : HttpDeviceOptions {
  OnvifSourceOptions() { rate_hz = 10; }  // SOAP is work for a camera

  std::string profile;  // token; empty: the device's first profile with PTZ
  // "/..." of the PTZ service at url's host and port, or ":8080/..." at another port; empty: as the device tells.
  std::string ptz_path;
  std::optional<OnvifRange> pan_range;
  std::optional<OnvifRange> tilt_range;
  // What the device tells at the ends of these ranges; none: onvif_scale.h.
  std::optional<OnvifInterval> pan_scale;
  std::optional<OnvifInterval> tilt_scale;
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_onvif(const OnvifSourceOptions& options);

}  // namespace alidade

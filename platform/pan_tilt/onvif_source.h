#pragma once
// open_onvif(): polls an ONVIF device for pan, tilt and zoom (PTZ service, GetStatus) over one
// persistent HTTP connection. Pace, stamps and threads: http_polling_source.h.
// At each (re)connection the source asks for the device's clock (if a login is configured), its
// services (GetCapabilities, or GetServices; only at the host of `url`: onvif_addresses.h), a
// profile with PTZ if none is configured, and the range of its positions (GetNodes, or
// GetConfigurationOptions) if OnvifScale needs it. Login: onvif_login.h.
// device_time_s: UtcTime as Unix time, if it is useful (device_clock_trial.h). The first answers
// are withheld until this is decided, so that all samples have a device time or none has.
// kDisconnected and kFailed: http_polling_source.h. kDisconnected also after an answer of more than
// 256 KiB, a SOAP fault, an HTTP status other than 200, an answer without a position, and a
// position outside its scale. kFailed also, before the first sample, for a wrong user or password,
// or a scale without angles.

#include <memory>
#include <optional>
#include <string>

#include "platform/pan_tilt/http_polling_source.h"
#include "platform/pan_tilt/onvif_scale.h"

namespace alidade {

// url: http[s]://host[:port][/onvif/device_service]. AxisMapping (pan, tilt) is applied to the
// angle that OnvifScale gives.
struct OnvifSourceOptions : HttpDeviceOptions {
  OnvifSourceOptions() { rate_hz = 10; }  // SOAP is costly for a camera

  std::string profile;  // token; empty: the device's first profile with PTZ
  // "/..." of the PTZ service at url's host and port, or ":8080/..." at another port. Empty: as the
  // device reports.
  std::string ptz_path;
  std::optional<OnvifRange> pan_range;
  std::optional<OnvifRange> tilt_range;
  // Device units at the ends of these ranges; nullopt: onvif_scale.h.
  std::optional<OnvifInterval> pan_scale;
  std::optional<OnvifInterval> tilt_scale;
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_onvif(const OnvifSourceOptions& options);

}  // namespace alidade

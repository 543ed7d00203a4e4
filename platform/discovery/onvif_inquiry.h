#pragma once
// inquire_onvif(): asks an ONVIF device what it is, which video streams it offers, and whether it
// has pan and tilt. Blocks: up to a dozen requests, each within timeout_s. Login as in
// onvif_login.h: by WS-UsernameToken on the device's clock, or HTTP digest if it is offered; at
// most three ways, as devices lock a user out. The login goes only to the host and port of `url`.

#include <string>

#include "platform/discovery/device_report.h"

namespace alidade {

// url: of the device service; http://host is completed.
[[nodiscard]] DeviceReport inquire_onvif(const std::string& url, const DeviceLogin& login,
                                         double timeout_s = 5);

// The stream's URL as it can be used: at the device's own host, whatever address it reports (many
// report one of another network), without user and password. Empty: not an RTSP URL. *moved: the
// reported host is another.
[[nodiscard]] std::string usable_stream_url(const std::string& reported, const std::string& host,
                                            bool* moved);

}  // namespace alidade

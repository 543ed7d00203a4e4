#pragma once
// inquire_vapix(): asks an Axis device by param.cgi what it is and what it can send. Blocks for one
// request. Devices tell that only to a user.

#include <string>

#include "platform/discovery/device_report.h"

namespace alidade {

// url: http://host[:port].
[[nodiscard]] DeviceReport inquire_vapix(const std::string& url, const DeviceLogin& login,
                                         double timeout_s = 5);

}  // namespace alidade

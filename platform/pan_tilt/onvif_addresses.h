#pragma once
// Candidate URLs of the services of an ONVIF device. The address that a device reports is often
// wrong: no host, 0.0.0.0, 127.0.0.1, the address on the other side of a router, a port that is not
// forwarded, the path of another service. No side effects.

#include <string>
#include <vector>

#include "platform/system/url.h"

namespace alidade {

enum class OnvifService { kMedia, kPtz };

// URLs to try, best first, without duplicates. All are at the host of `device` (the URL of the
// device service), as logins are sent there. told: the address that the device reports; may be
// empty. Order: the reported port and path, if other_port is true and the reported scheme and host
// are the device's; the reported path at the device's own port, also behind the prefix of a proxy
// (http://proxy/cam1/onvif/device_service); the usual paths; the URL of the device service itself.
// other_port: to be false if a login is sent.
[[nodiscard]] std::vector<std::string> onvif_addresses(const Url& device, const std::string& told,
                                                       OnvifService service,
                                                       bool other_port = false);

// This path at device's scheme, host and port. A path may start with another port: ":8080/path".
[[nodiscard]] std::string onvif_address(const Url& device, const std::string& path);

}  // namespace alidade

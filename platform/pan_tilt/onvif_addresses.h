#pragma once
// Where the services of an ONVIF device are reached. What a device tells of it is often wrong: no
// host, 0.0.0.0, 127.0.0.1, the address on the other side of a router, a port that is not
// forwarded, the path of another service. Pure.

#include <string>
#include <vector>

#include "platform/system/url.h"

namespace alidade {

enum class OnvifService { kMedia, kPtz };

// URLs to try, best first, none twice; all of `device`'s host, whatever host is told, as logins go
// there. device: of the device service. told: what the device tells, may be empty. A port of its
// own counts where the host that is told is the device's and no login goes along (other_port). Then the
// path that is told, at the device's own port, also behind the prefix of a proxy (http://proxy/cam1/onvif/device_service),
// then the paths that are usual.
[[nodiscard]] std::vector<std::string> onvif_addresses(const Url& device, const std::string& told,
                                                       OnvifService service,
                                                       bool other_port = false);

// http://host:port of device with this path, or with the port that stands before it: ":8080/path".
[[nodiscard]] std::string onvif_address(const Url& device, const std::string& path);

}  // namespace alidade

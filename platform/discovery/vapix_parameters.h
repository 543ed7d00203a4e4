#pragma once
// The parameters of an Axis device: the answer to param.cgi?action=list, lines `root.A.B=value`.
// No side effects: bytes in, values or a one-line error out.

#include <string>
#include <string_view>

#include "platform/discovery/device_report.h"

namespace alidade {

// The groups that are asked for.
inline constexpr const char* kVapixGroups =
    "root.Brand,root.Properties.Firmware.Version,root.Properties.Image.Format,"
    "root.Properties.Image.Resolution,root.Properties.PTZ.PTZ,root.Network.RTSP.Port,root.Image";

// host: of the streams' URLs. A client may ask for any codec and size, so those are offered that
// Alidade can use: each codec in the size that the device is set to, and in 1920x1080 if that is
// smaller. False: not such an answer.
[[nodiscard]] bool parse_vapix_parameters(std::string_view body, const std::string& host,
                                          DeviceReport* report, std::string* error);

}  // namespace alidade

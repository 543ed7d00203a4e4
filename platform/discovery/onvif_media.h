#pragma once
// ONVIF messages about a device and its video streams, in addition to those of onvif_messages.h:
// requests as text, answers as values. No side effects.
//   GetDeviceInformation          device service
//   GetProfiles, GetStreamUri     media service (ver10: H.264, JPEG) and media2 (ver20: H.265, too)

#include <string>
#include <string_view>
#include <vector>

#include "platform/discovery/device_report.h"
#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

constexpr const char* kOnvifMedia2 = "http://www.onvif.org/ver20/media/wsdl";
constexpr OnvifCall kGetDeviceInformation{kOnvifDevice, "GetDeviceInformation"};
constexpr OnvifCall kGetStreamUri{kOnvifMedia, "GetStreamUri"};
constexpr OnvifCall kGetProfiles2{kOnvifMedia2, "GetProfiles"};
constexpr OnvifCall kGetStreamUri2{kOnvifMedia2, "GetStreamUri"};

// What stands inside the element of the call. token: of the profile, for the calls of GetStreamUri.
[[nodiscard]] std::string onvif_media_content(const OnvifCall& call, const std::string& token);

// Sets maker, model and firmware.
[[nodiscard]] bool parse_onvif_device(std::string_view body, DeviceReport* report,
                                      std::string* error);

// The address of the service media2 in the answer to GetServices; empty: it has none.
[[nodiscard]] std::string parse_onvif_media2(std::string_view body);

// The streams of the profiles that have video, 64 at most, from the answer of media or media2,
// without their URLs. A stream whose token exceeds 200 bytes is left out.
[[nodiscard]] bool parse_onvif_streams(std::string_view body, std::vector<VideoStream>* streams,
                                       std::string* error);

// The stream's URL as the device reports it, 2000 bytes at most.
[[nodiscard]] bool parse_onvif_stream_url(std::string_view body, std::string* url,
                                          std::string* error);

}  // namespace alidade

#pragma once
// What `alidade discover` and `alidade setup` share: all cameras that can be found, each asked what
// it is. The login goes to the one device that the user names, never to whatever answers.

#include <functional>
#include <optional>
#include <string>

#include "edge_app/config/pan_tilt_config.h"
#include "edge_app/setup/camera_findings.h"
#include "platform/discovery/network_search.h"

namespace alidade {

struct CameraSearchOptions {
  NetworkSearchOptions network;  // duration_s 0: the network is not searched
  // Address or URL of the one to log in at, or the file of a device of this machine. Empty: none.
  // One that does not answer the search, as behind a router, is asked there anyway.
  std::string device;
  DeviceLogin login;
  bool try_telemetry = true;
};

// Blocks for the duration of the search, then for the questions: some seconds for each 16 cameras,
// which are asked at the same time. Throws CommandError if options.device is neither a file nor an
// address.
[[nodiscard]] CameraFindings find_cameras(const CameraSearchOptions& options);

// The camera that `device` names, borrowed from `findings`; null: there is none. If `device` is
// empty, find_camera() gives the only camera of the network; null if there are none or several.
// find_camera() throws CommandError if `device` is neither a file nor an address.
[[nodiscard]] const FoundCamera* find_camera(const CameraFindings& findings,
                                             const std::string& device);
[[nodiscard]] const VideoDevice* find_video_device(const CameraFindings& findings,
                                                   const std::string& device);

// Section `pan_tilt` for the camera's own telemetry; nullopt: it has none.
[[nodiscard]] std::optional<PanTiltConfig> telemetry_of(const FoundDevice& device,
                                                        const DeviceReport& report,
                                                        const DeviceLogin& login);

// The url of pan_tilt for this device service: without the usual port and path. A text that is not
// a URL is returned unchanged.
[[nodiscard]] std::string onvif_url_for_config(const std::string& url);

}  // namespace alidade

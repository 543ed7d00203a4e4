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

// Blocks: the duration of the search, and some seconds for the questions.
[[nodiscard]] CameraFindings find_cameras(const CameraSearchOptions& options);

// The one that is meant; null: none. Without a name the only camera of the network.
[[nodiscard]] const FoundCamera* find_camera(const CameraFindings& findings,
                                             const std::string& device);
[[nodiscard]] const VideoDevice* find_video_device(const CameraFindings& findings,
                                                   const std::string& device);

// Section `pan_tilt` for the camera's own telemetry; nullopt: it has none.
[[nodiscard]] std::optional<PanTiltConfig> telemetry_of(const FoundDevice& device,
                                                        const DeviceReport& report,
                                                        const DeviceLogin& login);

// The url of pan_tilt for this device service: without the usual path.
[[nodiscard]] std::string onvif_url_for_config(const std::string& url);

}  // namespace alidade

#pragma once
// What `alidade discover` and `alidade setup` have found, and the same as text and as JSON.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/setup/stream_choice.h"
#include "platform/discovery/device_report.h"
#include "platform/discovery/found_devices.h"
#include "platform/discovery/local_devices.h"

namespace alidade {

// The answer of a device's telemetry to one question.
struct TelemetryTrial {
  std::string type;  // vapix or onvif; empty: the device has none
  std::string url;
  bool asked = false;
  double pan_deg = 0;
  double tilt_deg = 0;
  std::optional<double> zoom;  // device units
  std::string error;           // one line; empty: it answered
};

// Whether an error of first_sample() says that the angles at both ends of the device's scale are
// needed.
[[nodiscard]] inline bool wants_ranges(const std::string& error) {
  return error.find("pan_range_deg") != std::string::npos;
}

struct FoundCamera {
  FoundDevice device;
  DeviceReport report;
  StreamChoice choice;
  TelemetryTrial telemetry;
};

struct CameraFindings {
  std::vector<std::string> interfaces;  // that were searched
  std::vector<FoundCamera> cameras;
  std::vector<VideoDevice> video_devices;
  std::vector<SerialPort> serial_ports;
  std::vector<std::string> notes;
};

// "AXIS Q6075-E", by what is known of it.
[[nodiscard]] std::string name_of(const FoundCamera& camera);

// Text of devices is escaped.
[[nodiscard]] std::string text_of_findings(const CameraFindings& findings);
[[nodiscard]] nlohmann::ordered_json json_of_findings(const CameraFindings& findings);

}  // namespace alidade

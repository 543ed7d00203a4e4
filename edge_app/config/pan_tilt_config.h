#pragma once
// Section `pan_tilt` of the configuration: where telemetry comes from, and its noise.

#include <array>
#include <optional>
#include <string>

#include "core/realtime/telemetry/telemetry_buffer.h"  // TelemetryLimits
#include "edge_app/config/head_config.h"
#include "edge_app/config/yaml_section.h"
#include "platform/system/link_rules.h"

namespace alidade {

struct PanTiltConfig {
  enum class Type { kVapix, kOnvif, kHead, kRecording, kNone };
  Type type = Type::kVapix;
  std::string url;        // vapix, onvif
  HeadConfig head;        // kHead: its key is in kHeads
  AxisMappings axes;      // not for recording
  std::string directory;  // recording
  std::string user;
  std::string password;
  LinkRules rules;       // vapix, onvif
  int camera = 0;        // vapix: camera number; 0: left out of the query
  std::string profile;   // onvif: token; empty: the device's first profile with PTZ
  std::string ptz_path;  // onvif: path of the PTZ service; empty: the path that the device gives
  // onvif: deg, the angles at both ends of the device's scale (-1 and 1 in the generic space).
  std::optional<std::array<double, 2>> pan_range_deg;
  std::optional<std::array<double, 2>> tilt_range_deg;
  // onvif: the positions that the device reports at these angles. Needed only if they differ
  // from -1 and 1 and from the range that the device declares.
  std::optional<std::array<double, 2>> pan_scale;
  std::optional<std::array<double, 2>> tilt_scale;
  double rate_hz = 30;                    // polls a second; default for onvif: 10
  double timeout_s = 1;                   // s; vapix, onvif: for one poll; a head: without a sample
  double max_backoff_s = 5;               // s, longest pause between two attempts to connect
  std::optional<double> angle_sigma_rad;  // rad, white noise of one measured angle
  double angle_quantum_rad = 0;           // rad, step of the encoder or of its output
  double angle_accuracy_deg = 0;  // deg, the maker's claim, one standard deviation; 0: no claim
  // rad/s^2, assumed where the samples do not show it.
  double acceleration_sigma_rad_s2 = TelemetryNoise().acceleration_sigma;
  // s, longest time between two measurements of the device; 0: each answer is a new measurement.
  double max_repeat_s = TelemetryLimits().max_repeat_s;
};

// `path`: of the configuration file; relative paths start at its folder. Throws ConfigError.
[[nodiscard]] PanTiltConfig read_pan_tilt(YamlSection section, const std::string& path);

}  // namespace alidade

#pragma once
// Section pan_tilt of the configuration: where telemetry comes from, and how good it is.

#include <array>
#include <optional>
#include <string>

#include "edge_app/config/head_config.h"
#include "edge_app/config/yaml_section.h"
#include "platform/system/link_rules.h"

namespace alidade {

struct PanTiltConfig {
  enum class Type { kVapix, kOnvif, kHead, kRecording, kNone };
  Type type = Type::kVapix;
  std::string url;        // vapix, onvif
  HeadConfig head;        // a key of kHeads
  AxisMappings axes;      // not of a recording
  std::string directory;  // recording
  std::string user;
  std::string password;
  LinkRules rules;       // vapix, onvif
  int camera = 0;        // VAPIX camera number; 0 leaves it out of the query
  std::string profile;   // onvif: token; empty: the device's first with PTZ
  std::string ptz_path;  // onvif: of the PTZ service; empty: as the device tells
  // onvif: the angles at both ends of the device's scale, -1 and 1 of the generic space.
  std::optional<std::array<double, 2>> pan_range_deg;
  std::optional<std::array<double, 2>> tilt_range_deg;
  // onvif: what the device tells at these angles, where it is neither -1 and 1 nor what it declares.
  std::optional<std::array<double, 2>> pan_scale;
  std::optional<std::array<double, 2>> tilt_scale;
  double rate_hz = 30;  // onvif: 10 unless given
  double timeout_s = 1;
  double max_backoff_s = 5;
  std::optional<double> angle_sigma_rad;   // white noise of one measured angle
  double angle_quantum_rad = 0;            // step of the encoder or of its print-out
  double acceleration_sigma_rad_s2 = 0.1;  // to expect of the head where samples do not show it
  double max_repeat_s =
      0.1;  // longest time between two measurements of the device; 0: each answer is fresh
};

// path: of the configuration's file, where relative paths start. Throws ConfigError.
[[nodiscard]] PanTiltConfig read_pan_tilt(YamlSection section, const std::string& path);

}  // namespace alidade

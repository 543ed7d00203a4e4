#pragma once
// The part of section pan_tilt that describes a head on a serial line, TCP or UDP: protocol, line, and
// what the device counts. Nothing about the head is guessed: where makers differ (degrees per step,
// which way counts as positive, the header of VISCA's datagrams) a key is required; what a protocol
// or the device itself says (Pelco-D's hundredths of a degree, a PTU's resolution) is the default.

#include <memory>
#include <string>
#include <variant>

#include "edge_app/config/yaml_section.h"
#include "platform/pan_tilt/pelco_d_protocol.h"
#include "platform/pan_tilt/ptu_protocol.h"
#include "platform/pan_tilt/query_source.h"
#include "platform/pan_tilt/visca_protocol.h"

namespace alidade {

struct HeadConfig {
  std::variant<PelcoDOptions, ViscaOptions, PtuOptions> protocol;
  ByteLinkOptions link;
};

// Sections' keys pan_positive, pan_zero_deg, tilt_positive, tilt_zero_deg. Which way counts as positive is required unless
// the kind of device (a value of pan_tilt.type) says it. Throws ConfigError.
struct AxisMappings {
  AxisMapping pan;
  AxisMapping tilt;
};
AxisMappings read_axes(YamlSection& section, const std::string& type);

// type: pelco_d, visca or ptu. *rate_hz: the default; then what is configured, or the default as far
// as the line carries it. Throws ConfigError.
HeadConfig read_head(YamlSection& section, const std::string& type, const std::string& config_path,
                     double* rate_hz);

std::unique_ptr<QueryProtocol> make_protocol(const HeadConfig& head);

}  // namespace alidade

#pragma once
// The part of section pan_tilt that describes a head on a serial line, TCP or UDP: protocol, line, and
// what the device counts. Nothing about the head is guessed: where makers differ (degrees per step,
// which way counts as positive) a key is required; what a protocol or the device itself says is the default.

#include <string>

#include "edge_app/config/yaml_section.h"
#include "platform/pan_tilt/heads.h"
#include "platform/pan_tilt/query_source.h"

namespace alidade {

struct HeadConfig {
  HeadOptions protocol;
  ByteLinkOptions link;
};

// Sections' keys pan_positive, pan_zero_deg, tilt_positive, tilt_zero_deg. Which way counts as positive is
// required where `usual` does not say it. Throws ConfigError.
struct AxisMappings {
  AxisMapping pan;
  AxisMapping tilt;
};
AxisMappings read_axes(YamlSection& section, const UsualSigns& usual);

// *rate_hz: the default; then what is configured, or the default as far as the line carries it. Throws
// ConfigError.
HeadConfig read_head(YamlSection& section, HeadType type, const std::string& config_path,
                     double* rate_hz);

}  // namespace alidade

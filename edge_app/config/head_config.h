#pragma once
// The part of section `pan_tilt` that describes a head on a serial line, TCP or UDP: the protocol,
// the line, and how the device counts. Nothing about the head is guessed. Where makers differ
// (degrees per step, sign) a key is required. Where the protocol or the device defines a value,
// that value is the default.

#include <string>

#include "edge_app/config/yaml_section.h"
#include "platform/pan_tilt/heads.h"
#include "platform/pan_tilt/query_source.h"

namespace alidade {

struct HeadConfig {
  HeadOptions protocol;
  ByteLinkOptions link;
};

// The keys pan_positive, pan_zero_deg, tilt_positive and tilt_zero_deg. pan_positive and
// tilt_positive are required if `usual` has no sign. Throws ConfigError.
struct AxisMappings {
  AxisMapping pan;
  AxisMapping tilt;
};
AxisMappings read_axes(YamlSection& section, const UsualSigns& usual);

// *rate_hz: in, the default; out, the configured rate, or else the default, limited to what the
// line can carry. A configured rate beyond that is an error. Throws ConfigError.
HeadConfig read_head(YamlSection& section, HeadType type, const std::string& config_path,
                     double* rate_hz);

}  // namespace alidade

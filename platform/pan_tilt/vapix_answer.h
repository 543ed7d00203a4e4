#pragma once
// The answer of an Axis camera to query=position, lines of key=value in degrees:
//   pan=51.2891\r\ntilt=46.1914\r\nzoom=1234\r\n...
// or "Error:..." (with HTTP status 200). No side effects: bytes in, value or error out.

#include <optional>
#include <string>
#include <string_view>

namespace alidade {

struct VapixPosition {
  double pan_rad = 0;
  double tilt_rad = 0;
  std::optional<double> zoom;  // device units
};

// Unknown keys are ignored. pan and tilt are required, each within -360..360 degrees. False: *error
// is one line, *position is unchanged.
[[nodiscard]] bool parse_vapix_position(std::string_view body, VapixPosition* position,
                                        std::string* error);

}  // namespace alidade

#include "platform/pan_tilt/vapix_answer.h"

#include <algorithm>
#include <cmath>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string shown_line(std::string_view text) { return shown(first_line(text)); }

}  // namespace

bool parse_vapix_position(std::string_view body, VapixPosition* position, std::string* error) {
  if (first_line(body).substr(0, 6) == "Error:") {
    *error = "the camera answers '" + shown_line(body) + "'";
    return false;
  }
  std::optional<double> pan_deg;
  std::optional<double> tilt_deg;
  std::optional<double> zoom;
  for (std::string_view rest = body; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      continue;
    }
    const std::string_view key = trimmed(line.substr(0, equals), kBlanks);
    std::optional<double>* target = key == "pan"    ? &pan_deg
                                    : key == "tilt" ? &tilt_deg
                                    : key == "zoom" ? &zoom
                                                    : nullptr;
    if (target == nullptr) {
      continue;
    }
    *target = parse_number(trimmed(line.substr(equals + 1), kBlanks));
    if (!*target) {
      *error = "'" + shown_line(line) + "' in the position is not a number";
      return false;
    }
  }
  for (const auto& [name, angle] : {std::pair("pan", &pan_deg), std::pair("tilt", &tilt_deg)}) {
    if (!*angle) {
      *error = std::string("no ") + name + " in the answer '" + shown_line(body) +
               "'; expected lines pan=, tilt=, zoom=";
      return false;
    }
    if (std::abs(**angle) > 360) {
      *error = std::string(name) + " is outside -360..360 degrees: " + shown(**angle);
      return false;
    }
  }
  position->pan_rad = *pan_deg * kRadPerDeg;
  position->tilt_rad = *tilt_deg * kRadPerDeg;
  position->zoom = zoom;
  return true;
}

}  // namespace alidade

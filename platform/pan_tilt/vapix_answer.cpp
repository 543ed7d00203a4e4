#include "platform/pan_tilt/vapix_answer.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string first_line(std::string_view text) {
  return shown(trimmed(text.substr(0, text.find('\n'))));
}

bool parse_number(std::string_view text, double* value) {
  const std::string copy(text);  // strtod needs the terminating null
  char* end = nullptr;
  *value = std::strtod(copy.c_str(), &end);
  return end != copy.c_str() && *end == '\0' && std::isfinite(*value);
}

}  // namespace

bool parse_vapix_position(std::string_view body, VapixPosition* position, std::string* error) {
  if (trimmed(body.substr(0, body.find('\n'))).substr(0, 6) == "Error:") {
    *error = "the camera answers '" + first_line(body) + "'";
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
    const std::string_view key = trimmed(line.substr(0, equals));
    std::optional<double>* target = key == "pan"    ? &pan_deg
                                    : key == "tilt" ? &tilt_deg
                                    : key == "zoom" ? &zoom
                                                    : nullptr;
    if (target == nullptr) {
      continue;
    }
    double value = 0;
    if (!parse_number(trimmed(line.substr(equals + 1)), &value)) {
      *error = "'" + first_line(line) + "' in the position is not a number";
      return false;
    }
    *target = value;
  }
  for (const auto& [name, angle] : {std::pair("pan", &pan_deg), std::pair("tilt", &tilt_deg)}) {
    if (!*angle) {
      *error = std::string("no ") + name + " in the answer '" + first_line(body) +
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

#include "edge_app/setup/config_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

// deg; beyond these a data sheet means something else, such as the diagonal of a fisheye lens.
constexpr double kLeastField_deg = 0.05;
constexpr double kMostField_deg = 150;

std::optional<double> field_in(const std::string& text) {
  const std::optional<double> value = parse_number(trimmed(text, " "));
  return value && *value >= kLeastField_deg && *value <= kMostField_deg ? value : std::nullopt;
}

double focal_length_px(double field_deg, int width_px) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  return 0.5 * width_px / std::tan(0.5 * kRadians * field_deg);
}

bool is_name(const std::string& text) {
  return !text.empty() &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
}

}  // namespace

std::string yaml_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == '\x7F') {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

void ConfigText::set(const std::string& section, const std::string& key, const std::string& value) {
  auto found = std::find_if(sections_.begin(), sections_.end(),
                            [&](const Section& each) { return each.name == section; });
  if (found == sections_.end()) {
    sections_.push_back({section, {}});
    found = std::prev(sections_.end());
  }
  const auto old = std::find_if(found->keys.begin(), found->keys.end(),
                                [&](const auto& each) { return each.first == key; });
  if (old == found->keys.end()) {
    found->keys.emplace_back(key, value);
  } else {
    old->second = value;
  }
}

void ConfigText::set_text(const std::string& section, const std::string& key,
                          const std::string& text) {
  set(section, key, yaml_quoted(text));
}

bool ConfigText::set_by_word(const std::string& word, std::string* error) {
  const std::size_t dot = word.find('.');
  const std::size_t equals = word.find('=');
  if (dot == std::string::npos || equals == std::string::npos || equals < dot ||
      !is_name(word.substr(0, dot)) || !is_name(word.substr(dot + 1, equals - dot - 1)) ||
      equals + 1 == word.size() || word.find('\n') != std::string::npos) {
    *error = fmt::format(
        "'{}' sets nothing; expected SECTION.KEY=VALUE, as "
        "pan_tilt.pan_range_deg=[-180,180]",
        shown(word));
    return false;
  }
  set(word.substr(0, dot), word.substr(dot + 1, equals - dot - 1), word.substr(equals + 1));
  return true;
}

std::string ConfigText::text(const std::vector<std::string>& comment) const {
  std::string text;
  for (const std::string& line : comment) text += "# " + line + "\n";
  for (const Section& section : sections_) {
    if (!text.empty()) text += '\n';
    text.append(section.name).append(":\n");
    for (const auto& [key, value] : section.keys)
      text.append("  ").append(key).append(": ").append(value).append("\n");
  }
  return text;
}

bool focal_length_of(const std::string& field_of_view, int width_px, std::string* value,
                     std::string* error) {
  const std::size_t colon = field_of_view.find(':');
  const std::optional<double> wide = field_in(field_of_view.substr(0, colon));
  const std::optional<double> tele =
      colon == std::string::npos ? wide : field_in(field_of_view.substr(colon + 1));
  if (!wide || !tele || (colon != std::string::npos && *tele >= *wide)) {
    *error = fmt::format(
        "'{}' is no horizontal field of view; expected degrees from {} to {}, as 3.4, or of a lens "
        "that zooms wide:tele, as 62:2.3",
        shown(field_of_view), kLeastField_deg, kMostField_deg);
    return false;
  }
  const auto rounded = [&](double field_deg) {
    return fmt::format("{:.0f}", focal_length_px(field_deg, width_px));
  };
  *value = colon == std::string::npos
               ? rounded(*wide)
               : "{wide: " + rounded(*wide) + ", tele: " + rounded(*tele) + "}";
  return true;
}

}  // namespace alidade

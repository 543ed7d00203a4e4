#include "edge_app/commands/option_checks.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "core/calibration/number_text.h"
#include "core/model/pupil.h"
#include "edge_app/commands/live_pattern.h"

namespace alidade {

std::string is_duration(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value > 0 ? "" : fmt::format("'{}' is not a number of seconds above 0", text);
}

std::string is_film_duration(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value > 0 && *value <= kLongestFilm_s
             ? ""
             : fmt::format("'{}' is not a number of seconds above 0, up to {:.0f}", text,
                           kLongestFilm_s);
}

std::string is_accuracy(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value >= 0 && *value <= 5
             ? ""
             : fmt::format("'{}' is not a number of degrees from 0 to 5", text);
}

std::string is_turn_sigma(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return text == "free" || (value && *value >= 0 && *value <= 10)
             ? ""
             : fmt::format("'{}' is neither a number of degrees from 0 to 10 nor free", text);
}

std::string is_share(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value >= 0 && *value <= 1
             ? ""
             : fmt::format("'{}' is not a number from 0 to 1", text);
}

std::string is_length_px(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value >= 0 && *value <= 1e4
             ? ""
             : fmt::format("'{}' is not a number of pixels from 0 to 10000", text);
}

std::string is_pupil_place(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && std::abs(*value) <= kFarthestPupil_m
             ? ""
             : fmt::format("'{0}' is not a number of metres from -{1:g} to {1:g}", text,
                           kFarthestPupil_m);
}

std::string is_scene_distance(const std::string& text) {
  const std::optional<double> value = number_of(text);
  return value && *value >= kNearestScene_m
             ? ""
             : fmt::format("'{}' is not a number of metres, {:g} or more", text, kNearestScene_m);
}

}  // namespace alidade

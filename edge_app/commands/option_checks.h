#pragma once
// What the values of options may be, for the parser of the command line: each check returns what is
// wrong with a text, and what would be right, or nothing. The parser's own checks of numbers print
// their limits with up to 300 digits. Pure; allocates.

#include <string>

namespace alidade {

[[nodiscard]] std::string is_duration(const std::string& text);        // s, above 0
[[nodiscard]] std::string is_film_duration(const std::string& text);   // to kLongestFilm_s
[[nodiscard]] std::string is_accuracy(const std::string& text);        // degrees, 0 to 5
[[nodiscard]] std::string is_turn_sigma(const std::string& text);      // degrees to 10, or free
[[nodiscard]] std::string is_share(const std::string& text);           // 0 to 1
[[nodiscard]] std::string is_length_px(const std::string& text);       // 0 to 10000
[[nodiscard]] std::string is_pupil_place(const std::string& text);     // m, to kFarthestPupil_m
[[nodiscard]] std::string is_scene_distance(const std::string& text);  // m, kNearestScene_m or more

}  // namespace alidade

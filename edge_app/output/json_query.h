#pragma once
// What requests as JSON have in common: read strictly (an unknown key, a wrong type, what is not finite is an error that says so), by pure
// parsers that take memory in proportion to the text, which the caller bounds; and the choice of a frame.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>

namespace alidade {

// Neither: the newest with an orientation. Never both.
struct FrameChoice {
  std::optional<std::int64_t> frame;
  std::optional<double> time_s;
};

// An object no deeper than this, with no other keys. False with one line in *error.
[[nodiscard]] bool parse_json_object(const std::string& body, int deepest,
                                     const std::set<std::string>& keys,
                                     nlohmann::ordered_json* object, std::string* error);
[[nodiscard]] bool has_known_keys_only(const nlohmann::ordered_json& object,
                                       const std::set<std::string>& keys, std::string* error);

inline constexpr const char* kFrameNumberRange = "frame must be an integer, 0 or more, below 2^63";

// A frame's number as a query has it: digits, of the range that JSON may tell. Empty: it is none.
[[nodiscard]] std::optional<std::int64_t> frame_number(const std::string& text);

// Keys frame and time_s.
[[nodiscard]] bool parse_frame_choice(const nlohmann::ordered_json& object, FrameChoice* which,
                                      std::string* error);

}  // namespace alidade

#pragma once
// What requests in JSON share: strict reading and the choice of a frame. An unknown key, a wrong
// type or a number that is not finite is an error that says which. The parsers are pure. They take
// memory in proportion to the text; the caller limits the text's length.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>

namespace alidade {

// At most one is set. Neither: the newest frame with an orientation.
struct FrameChoice {
  std::optional<std::int64_t> frame;
  std::optional<double> time_s;
};

// Parses an object of at most this depth with only these keys. False with one line in *error.
[[nodiscard]] bool parse_json_object(const std::string& body, int deepest,
                                     const std::set<std::string>& keys,
                                     nlohmann::ordered_json* object, std::string* error);
[[nodiscard]] bool has_known_keys_only(const nlohmann::ordered_json& object,
                                       const std::set<std::string>& keys, std::string* error);

inline constexpr const char* kFrameNumberRange = "frame must be an integer, 0 or more, below 2^63";

// A frame number from a query: digits only, in the same range as in JSON. Empty: not a frame
// number.
[[nodiscard]] std::optional<std::int64_t> frame_number(const std::string& text);

// Reads the keys frame and time_s.
[[nodiscard]] bool parse_frame_choice(const nlohmann::ordered_json& object, FrameChoice* which,
                                      std::string* error);

}  // namespace alidade

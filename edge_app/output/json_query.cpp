#include "edge_app/output/json_query.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>

namespace alidade {

using Json = nlohmann::ordered_json;

namespace {

// A deep document would take a hundred bytes of memory for each of its own.
bool is_shallow(const std::string& text, int deepest) {
  int depth = 0;
  bool in_string = false;
  bool escaped = false;
  for (const char c : text) {
    if (in_string) {
      in_string = escaped || c != '"';
      escaped = !escaped && c == '\\';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > deepest) return false;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return true;
}

}  // namespace

bool parse_json_object(const std::string& body, int deepest, const std::set<std::string>& keys,
                       Json* object, std::string* error) {
  if (!is_shallow(body, deepest)) {
    *error = "the body is nested too deeply";
    return false;
  }
  *object = Json::parse(body, nullptr, false);
  if (!object->is_object()) {
    *error = "the body must be a JSON object";
    for (const char* word : {"NaN", "Infinity"}) {
      if (object->is_discarded() && body.find(word) != std::string::npos)
        *error += std::string("; ") + word + " is not a JSON number";
    }
    return false;
  }
  return has_known_keys_only(*object, keys, error);
}

bool has_known_keys_only(const Json& object, const std::set<std::string>& keys,
                         std::string* error) {
  for (const auto& item : object.items()) {
    if (keys.count(item.key()) != 0) continue;
    *error = "unknown key; known here: ";
    for (const std::string& key : keys) *error += (key == *keys.begin() ? "" : ", ") + key;
    return false;
  }
  return true;
}

std::optional<std::int64_t> frame_number(const std::string& text) {
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data(), end, number);
  if (failure != std::errc() || stop != end || text.front() == '-') return std::nullopt;
  return number;
}

bool parse_frame_choice(const Json& object, FrameChoice* which, std::string* error) {
  const auto frame = object.find("frame");
  const auto time = object.find("time_s");
  if (frame != object.end() && time != object.end()) {
    *error = "frame and time_s exclude each other; give one, or none for the newest frame";
    return false;
  }
  if (frame != object.end()) {
    const bool fits = frame->is_number_unsigned() &&
                      frame->get<std::uint64_t>() <=
                          static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (!fits) {
      *error = kFrameNumberRange;
      return false;
    }
    which->frame = frame->get<std::int64_t>();
  }
  if (time != object.end()) {
    if (!time->is_number() || !std::isfinite(time->get<double>())) {
      *error = "time_s must be a number";
      return false;
    }
    which->time_s = time->get<double>();
  }
  return true;
}

}  // namespace alidade

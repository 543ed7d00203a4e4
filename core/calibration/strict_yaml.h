#pragma once
// YAML, read strictly: what every file of ours has in common, whatever it says. A key is a plain word, stands once and
// is known; a number is finite and nothing but a number (number_text.h); a mistake is one line, which names the file
// and the line. What is asked for and how a mistake is put into words is the caller's: parse_calibration() and the
// configuration's YamlSection. Allocates.

#include <yaml-cpp/yaml.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace alidade {

// One line: where, what is wrong; what would be right. Thrown by what reads, caught by read_yaml().
struct YamlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The line of a node, from 1; nothing for one that is not in the text.
[[nodiscard]] std::optional<int> line_of(const YAML::Node& node);

enum class KeyFault {
  kNoWord,  // a list or a mapping
  kDoubled,
  kUnknown
};

// The first key of a mapping with a fault. known: which there may be; empty: any.
struct FaultyKey {
  KeyFault fault;
  YAML::Node key;
};
[[nodiscard]] std::optional<FaultyKey> find_faulty_key(const YAML::Node& map,
                                                       const std::vector<std::string>& known = {});

// What is said of a text that is no YAML: `name:line: BEFORE what the parser says AFTER`.
struct NotYaml {
  const char* before;
  const char* after;
};

// Hands the text to `read`, which may throw YamlError. False with one line in *error if it did, or if the text is not
// YAML. name stands for the file in errors.
[[nodiscard]] bool read_yaml(const std::string& text, const std::string& name,
                             const NotYaml& not_yaml,
                             const std::function<void(const YAML::Node&)>& read,
                             std::string* error);

// "a, b, c"
[[nodiscard]] std::string join(const std::vector<std::string>& words);

}  // namespace alidade

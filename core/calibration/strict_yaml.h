#pragma once
// Strict YAML, common to all files of the program. A key is a plain, known word that occurs once. A
// number is finite and nothing but a number (number_text.h). An error is one line that names the
// file and the line. The caller decides what it reads and how errors are worded:
// parse_calibration() and the configuration's YamlSection. Allocates.

#include <yaml-cpp/yaml.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace alidade {

// Its text is one line: where, what is wrong; what would be right. Readers throw it, read_yaml()
// catches it.
struct YamlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The line of a node, counted from 1; nothing for a node that is not in the text.
[[nodiscard]] std::optional<int> line_of(const YAML::Node& node);

enum class KeyFault {
  kNoWord,  // a list or a mapping
  kDoubled,
  kUnknown
};

struct FaultyKey {
  KeyFault fault;
  YAML::Node key;
};
// The first key with a fault; empty: there is none. map: must be a mapping. known: the allowed
// keys; empty: any.
[[nodiscard]] std::optional<FaultyKey> find_faulty_key(const YAML::Node& map,
                                                       const std::vector<std::string>& known = {});

// Message for a text that is not YAML: `name:line: BEFORE the parser's message AFTER`.
struct NotYaml {
  const char* before;
  const char* after;
};

// Hands the parsed text to `read`, which may throw YamlError. False and one line in *error if
// `read` threw it, or if the text is not YAML. name stands for the file in errors.
[[nodiscard]] bool read_yaml(const std::string& text, const std::string& name,
                             const NotYaml& not_yaml,
                             const std::function<void(const YAML::Node&)>& read,
                             std::string* error);

// "a, b, c"
[[nodiscard]] std::string join(const std::vector<std::string>& words);

}  // namespace alidade

#pragma once
// One mapping of a YAML configuration, read strictly (core/calibration/strict_yaml.h).
//
// Each reader (text, number, ...) returns the value of a key and checks its type and range.
// finish() then rejects every key that no reader asked for. A failure throws ConfigError, one line:
//     FILE:LINE: SECTION.KEY: what is wrong; what would be right
// An absent key gives an empty optional. A key without a value is an error. A number is plain: its
// unit belongs to the key's name. Quoted numbers, and words such as "yes" for a truth value, are
// errors, as they hide mistakes.

#include <yaml-cpp/yaml.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/strict_yaml.h"

namespace alidade {

using ConfigError = YamlError;

// Inclusive limits of a number, and its unit for messages ("px", "s", "1").
struct NumberRange {
  double low;
  double high;
  const char* unit;
};

class YamlSection {
 public:
  // `name` is "" for the top of the file. `node` may be null: an empty section.
  YamlSection(const YAML::Node& node, std::string name, std::string file);

  [[nodiscard]] bool has(const std::string& key) const;
  [[nodiscard]] bool is_section(const std::string& key) const;
  std::optional<std::string> text(const std::string& key);
  std::optional<double> number(const std::string& key, const NumberRange& range);
  // A list of exactly `count` numbers.
  std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count,
                                             const NumberRange& range);
  std::optional<int> integer(const std::string& key, const NumberRange& range);
  std::optional<bool> truth(const std::string& key);
  // One of `available`. A word of `planned` is refused as not available in this version.
  std::optional<std::string> choice(const std::string& key,
                                    const std::vector<std::string>& available,
                                    const std::vector<std::string>& planned = {});
  // A section inside this one; empty if the key is absent.
  YamlSection section(const std::string& key);
  // A list of sections, named KEY[0] and so on; empty if the key is absent.
  std::vector<YamlSection> sections(const std::string& key);

  // Throws if there is a key that no reader asked for.
  void finish() const;

  // "FILE:LINE: SECTION.KEY". If the key is absent, the line is the section's.
  [[nodiscard]] std::string where(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& what) const;
  // For a required key: "is missing; EXPECTED". If a key of the file looks like a mistyped one, the
  // message names it.
  [[noreturn]] void fail_missing(const std::string& key, const std::string& expected) const;

 private:
  [[nodiscard]] std::optional<YAML::Node> find(const std::string& key) const;
  [[nodiscard]] std::string path_of(const std::string& key) const;  // SECTION.KEY
  // The value as text. `expected` completes "expected ...". `plain`: quoted text is refused.
  std::optional<std::string> scalar(const std::string& key, const std::string& expected,
                                    bool plain);

  YAML::Node node_;
  std::string name_;
  std::string file_;
  std::vector<std::string> asked_;
};

// Hands the top section of a YAML text to `read`, which may throw ConfigError. False with one line
// in *error if the text is not YAML or `read` threw. `name` names the file in errors.
[[nodiscard]] bool parse_yaml(const std::string& text, const std::string& name,
                              const std::function<void(YamlSection&)>& read, std::string* error);

// The same for a file. A file that cannot be read is an error, too.
[[nodiscard]] bool read_yaml_file(const std::string& path,
                                  const std::function<void(YamlSection&)>& read,
                                  std::string* error);

}  // namespace alidade

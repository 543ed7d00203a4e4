#include "edge_app/config/yaml_section.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/calibration/number_text.h"
#include "edge_app/config/nearest_word.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

std::string place(const std::string& file, const YAML::Node& node) {
  const std::optional<int> line = line_of(node);
  return line ? fmt::format("{}:{}", file, *line) : file;
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

bool parse_yaml(const std::string& text, const std::string& name,
                const std::function<void(YamlSection&)>& read, std::string* error) {
  return read_yaml(
      text, name, {"not YAML: ", "; check indentation, colons and quotes"},
      [&](const YAML::Node& root) {
        YamlSection top(root, "", name);
        read(top);
      },
      error);
}

bool read_yaml_file(const std::string& path, const std::function<void(YamlSection&)>& read,
                    std::string* error) {
  std::string text;
  if (!read_file(path, &text, error)) {
    error->append("; expected a YAML file");
    return false;
  }
  return parse_yaml(text, path, read, error);
}

YamlSection::YamlSection(const YAML::Node& node, std::string name, std::string file)
    : node_(node), name_(std::move(name)), file_(std::move(file)) {
  if (!node_.IsDefined() || node_.IsNull()) {
    node_ = YAML::Node(YAML::NodeType::Map);
    return;
  }
  const std::string title = name_.empty() ? "configuration" : name_;
  if (!node_.IsMap()) {
    throw ConfigError(
        fmt::format("{}: {}: expected a mapping of keys to values", place(file_, node_), title));
  }
  const std::optional<FaultyKey> found = find_faulty_key(node_);
  if (!found) return;
  const std::string at = place(file_, found->key);
  throw ConfigError(found->fault == KeyFault::kNoWord
                        ? fmt::format("{}: {}: a key must be a plain word", at, title)
                        : fmt::format("{}: {}: key '{}' is given twice; keep one", at, title,
                                      found->key.Scalar()));
}

std::optional<YAML::Node> YamlSection::find(const std::string& key) const {
  for (const auto& entry : node_) {
    if (entry.first.Scalar() == key) return entry.second;
  }
  return std::nullopt;
}

bool YamlSection::has(const std::string& key) const { return find(key).has_value(); }

bool YamlSection::is_section(const std::string& key) const {
  const std::optional<YAML::Node> node = find(key);
  return node && node->IsMap();
}

std::string YamlSection::where(const std::string& key) const {
  // Take the line of the key: an empty value has no line of its own.
  std::string at = place(file_, node_);
  for (const auto& entry : node_) {
    if (entry.first.Scalar() == key) at = place(file_, entry.first);
  }
  return fmt::format("{}: {}", at, path_of(key));
}

std::string YamlSection::path_of(const std::string& key) const {
  return name_.empty() ? key : name_ + "." + key;
}

void YamlSection::fail(const std::string& key, const std::string& what) const {
  throw ConfigError(where(key) + ": " + what);
}

void YamlSection::fail_missing(const std::string& key, const std::string& expected) const {
  for (const auto& entry : node_) {
    const std::string& other = entry.first.Scalar();
    if (!contains(asked_, other) && nearest_word(other, {key})) {
      fail(other, "unknown key" + did_you_mean(other, {key}));
    }
  }
  fail(key, "is missing; " + expected);
}

std::optional<std::string> YamlSection::scalar(const std::string& key, const std::string& expected,
                                               bool plain) {
  asked_.push_back(key);
  const std::optional<YAML::Node> value = find(key);
  if (!value) return std::nullopt;
  if (value->IsNull()) fail(key, "has no value; expected " + expected);
  if (!value->IsScalar()) fail(key, "expected " + expected + ", not a list or mapping");
  // yaml-cpp tags quoted scalars "!" and plain scalars "?".
  if (plain && value->Tag() == "!") {
    fail(key, fmt::format("'{}' is quoted text; expected {}", value->Scalar(), expected));
  }
  return value->Scalar();
}

std::optional<std::string> YamlSection::text(const std::string& key) {
  std::optional<std::string> value = scalar(key, "text", false);
  if (value && value->empty()) fail(key, "is empty; expected text");
  return value;
}

std::optional<double> YamlSection::number(const std::string& key, const NumberRange& range) {
  const std::string expected =
      fmt::format("a plain number from {} to {} ({})", range.low, range.high, range.unit);
  const std::optional<std::string> value = scalar(key, expected, true);
  if (!value) return std::nullopt;
  const std::optional<double> number = number_of(*value);
  if (!number || *number < range.low || *number > range.high) {
    fail(key, fmt::format("'{}' is not {}", *value, expected));
  }
  return number;
}

std::optional<std::vector<double>> YamlSection::numbers(const std::string& key, std::size_t count,
                                                        const NumberRange& range) {
  asked_.push_back(key);
  const std::optional<YAML::Node> list = find(key);
  if (!list) return std::nullopt;
  const std::string expected = fmt::format("a list of {} plain numbers from {} to {} ({})", count,
                                           range.low, range.high, range.unit);
  if (!list->IsSequence() || list->size() != count) fail(key, "expected " + expected);
  std::vector<double> values;
  for (const YAML::Node& item : *list) {
    const std::optional<double> value =
        item.IsScalar() ? number_of(item.Scalar()) : std::optional<double>();
    if (!value || *value < range.low || *value > range.high) fail(key, "expected " + expected);
    values.push_back(*value);
  }
  return values;
}

std::optional<int> YamlSection::integer(const std::string& key, const NumberRange& range) {
  const std::optional<double> value = number(key, range);
  if (!value) return std::nullopt;
  if (*value != std::floor(*value)) fail(key, fmt::format("{} is not a whole number", *value));
  return static_cast<int>(*value);
}

std::optional<bool> YamlSection::truth(const std::string& key) {
  const std::optional<std::string> value = scalar(key, "true or false", true);
  if (!value) return std::nullopt;
  if (*value != "true" && *value != "false")
    fail(key, fmt::format("'{}' is not true or false", *value));
  return *value == "true";
}

std::optional<std::string> YamlSection::choice(const std::string& key,
                                               const std::vector<std::string>& available,
                                               const std::vector<std::string>& planned) {
  std::optional<std::string> value = scalar(key, "one of " + join(available), false);
  if (!value || contains(available, *value)) return value;
  fail(key, contains(planned, *value)
                ? fmt::format("'{}' is not available in this version; available: {}", *value,
                              join(available))
                : fmt::format("'{}' is unknown; expected one of {}{}", *value, join(available),
                              did_you_mean(*value, available)));
}

YamlSection YamlSection::section(const std::string& key) {
  asked_.push_back(key);
  const std::optional<YAML::Node> value = find(key);
  return YamlSection(value ? *value : YAML::Node(), path_of(key), file_);
}

std::vector<YamlSection> YamlSection::sections(const std::string& key) {
  asked_.push_back(key);
  const std::optional<YAML::Node> value = find(key);
  if (!value) return {};
  if (!value->IsSequence()) fail(key, "expected a list of mappings; write `- {key: value, ...}`");
  std::vector<YamlSection> out;
  for (const YAML::Node& item : *value)
    out.emplace_back(item, fmt::format("{}[{}]", path_of(key), out.size()), file_);
  return out;
}

void YamlSection::finish() const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.Scalar();
    if (contains(asked_, key)) continue;
    fail(key, "unknown key; known here: " + join(asked_) + did_you_mean(key, asked_));
  }
}

}  // namespace alidade

#pragma once
// One mapping of a strictly checked YAML file: its keys with their units and ranges. Throws
// ConfigError, with file and line.

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::simulator {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Range {
  double lowest;
  double highest;
};
inline constexpr Range kAny{-kInfinity, kInfinity};
inline constexpr Range kNotNegative{0, kInfinity};
inline constexpr Range kPositive{std::numeric_limits<double>::min(), kInfinity};
inline constexpr Range kUnitInterval{0, 1};
inline constexpr Range kPort{0, 65535};

// One mapping of the file: every key is asked for by name, and finish() rejects what nobody asked
// for. A key that is absent leaves the value as it was.
class Section {
 public:
  Section(std::filesystem::path file, const YAML::Node& node, std::string name)
      : file_(std::move(file)), node_(node), name_(std::move(name)) {
    if (!node_.IsMap()) fail(node_, "'" + name_ + "' must hold keys with values");
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& what) const {
    throw ConfigError(file_.string() + ":" + std::to_string(node.Mark().line + 1) + ": " + what);
  }
  [[noreturn]] void fail(const std::string& what) const { fail(node_, what); }

  [[nodiscard]] bool has(const char* key) const { return node_[key].IsDefined(); }

  [[nodiscard]] bool is_section(const char* key) const {
    return node_[key].IsDefined() && node_[key].IsMap();
  }

  // The number in the file times `unit` becomes the value; the range is that of the file.
  void number(const char* key, double* value, Range range = kAny, double unit = 1) {
    if (const YAML::Node node = take(key)) *value = scalar(node, key, range) * unit;
  }

  void integer(const char* key, int* value, Range range) {
    if (const YAML::Node node = take(key)) {
      const double number = scalar(node, key, range);
      if (number != std::floor(number)) fail(node, std::string(key) + " must be a whole number");
      *value = static_cast<int>(number);
    }
  }

  void flag(const char* key, bool* value) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsScalar() || !YAML::convert<bool>::decode(node, *value)) {
        fail(node, std::string(key) + " must be true or false");
      }
    }
  }

  void pair(const char* key, Eigen::Vector2d* value, double unit) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsSequence() || node.size() != 2) {
        fail(node, std::string(key) + " must be two numbers: [a, b]");
      }
      *value = Eigen::Vector2d(scalar(node[0], key, kAny), scalar(node[1], key, kAny)) * unit;
    }
  }

  void triple(const char* key, Eigen::Vector3d* value, Range range, double unit) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsSequence() || node.size() != 3) {
        fail(node, std::string(key) + " must be three numbers: [a, b, c]");
      }
      for (int i = 0; i < 3; ++i) (*value)[i] = scalar(node[i], key, range) * unit;
    }
  }

  void text(const char* key, std::string* value) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsScalar()) fail(node, std::string(key) + " must be a text");
      *value = node.Scalar();
    }
  }

  void path(const char* key, std::filesystem::path* value) {
    std::string name;
    text(key, &name);
    if (!name.empty()) *value = file_.parent_path() / name;
  }

  template <class Value>
  void choice(const char* key, Value* value,
              const std::vector<std::pair<const char*, Value>>& choices) {
    const YAML::Node node = take(key);
    if (!node) return;
    std::string names;
    for (const auto& [name, choice] : choices) {
      if (node.IsScalar() && node.Scalar() == name) {
        *value = choice;
        return;
      }
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    fail(node, std::string(key) + " must be one of: " + names);
  }

  void section(const char* key, const std::function<void(Section&)>& read) {
    if (const YAML::Node node = take(key)) visit(node, key, read);
  }

  void list(const char* key, const std::function<void(Section&)>& read) {
    const YAML::Node node = take(key);
    if (!node) return;
    if (!node.IsSequence()) fail(node, std::string(key) + " must be a list");
    for (const YAML::Node& item : node) visit(item, key, read);
  }

  void finish() const {
    for (const auto& item : node_) {
      const std::string key = item.first.Scalar();
      if (known_.count(key) == 0) fail(item.first, "unknown key '" + key + "' in " + name_);
    }
  }

 private:
  YAML::Node take(const char* key) {
    known_.insert(key);
    return std::as_const(node_)[key];
  }

  void visit(const YAML::Node& node, const char* key, const std::function<void(Section&)>& read) {
    Section section(file_, node, key);
    read(section);
    section.finish();
  }

  double scalar(const YAML::Node& node, const char* key, Range range) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      fail(node, std::string(key) + " must be a number");
    }
    if (value < range.lowest || value > range.highest) {
      std::string bounds = range.lowest == kPositive.lowest ? "more than 0" : "";
      if (bounds.empty() && range.highest == kInfinity) bounds = "0 or more";
      if (bounds.empty()) {
        std::ostringstream text;  // not every digit of a binary fraction
        text << "between " << range.lowest << " and " << range.highest;
        bounds = text.str();
      }
      fail(node, std::string(key) + " is " + node.Scalar() + ", must be " + bounds);
    }
    return value;
  }

  std::filesystem::path file_;
  YAML::Node node_;
  std::string name_;
  std::set<std::string> known_;
};

}  // namespace alidade::simulator

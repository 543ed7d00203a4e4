#include "edge_app/record/record_format.h"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "edge_app/record/record_fields.h"

namespace alidade {
namespace {

constexpr std::size_t kLongestLine = 2048;  // bytes that most lines do not exceed

// One line in memory of its own. nothing: how this kind of line writes a missing value.
class Text {
 public:
  explicit Text(std::string_view nothing) : nothing_(nothing) { text_.reserve(kLongestLine); }

  void put(std::string_view text) { text_.append(text); }
  void put(char one) { text_.push_back(one); }
  void put_value(bool value) { put(value ? "true" : "false"); }
  void put_value(std::int64_t value) {
    fmt::format_to(std::back_inserter(text_), FMT_COMPILE("{}"), value);
  }
  // A number that is not finite is written as a missing value.
  void put_value(double value) {
    if (!std::isfinite(value)) return put(nothing_);
    const std::size_t begin = text_.size();
    fmt::format_to(std::back_inserter(text_), FMT_COMPILE("{}"), value);
    // A whole number gets ".0", so that the field is always a floating-point number.
    if (text_.find_first_of(".e", begin) == std::string::npos) put(".0");
  }
  template <class T>
  void put_value(const std::optional<T>& value) {
    value ? put_value(*value) : put(nothing_);
  }

 protected:
  // Replaces the comma after the last field.
  void end(std::string_view by) {
    text_.pop_back();
    put(by);
  }
  [[nodiscard]] std::string take(std::string_view by) {
    end(by);
    return std::move(text_);
  }

 private:
  std::string_view nothing_;
  std::string text_;
};

class JsonLine : public Text {
 public:
  JsonLine() : Text("null") { put('{'); }

  template <class T>
  void add(std::string_view name, const T& value) {
    put_name(name);
    put_json(value);
    put(',');
  }
  template <std::size_t kSize>
  void add(std::string_view name, const Columns<kSize>&,
           const std::optional<std::array<double, kSize>>& values) {
    put_name(name);
    if (!values) {
      put("null,");
      return;
    }
    char before = '[';
    for (const double value : *values) {
      put(before);
      put_value(value);
      before = ',';
    }
    put("],");
  }
  template <std::size_t kSize>
  void add_object(std::string_view name, const Columns<kSize>& keys,
                  const std::optional<std::array<double, kSize>>& values) {
    put_name(name);
    if (!values) {
      put("null,");
      return;
    }
    put('{');
    for (std::size_t i = 0; i < kSize; ++i) add(keys[i], (*values)[i]);
    end("},");
  }
  [[nodiscard]] std::string line() { return take("}\n"); }

 private:
  void put_name(std::string_view name) {
    put('"');
    put(name);
    put("\":");
  }
  // These texts are the program's own and need no escapes in JSON.
  void put_json(std::string_view word) {
    put('"');
    put(word);
    put('"');
  }
  void put_json(const std::optional<std::string_view>& word) {
    word ? put_json(*word) : put("null");
  }
  template <class T>
  void put_json(const T& value) {
    put_value(value);
  }
};

class CsvLine : public Text {
 public:
  CsvLine() : Text("") {}

  void add(std::string_view, std::string_view word) {
    put(word);
    put(',');
  }
  void add(std::string_view, const std::optional<std::string_view>& word) {
    put(word.value_or(""));
    put(',');
  }
  template <class T>
  void add(std::string_view, const T& value) {
    put_value(value);
    put(',');
  }
  template <std::size_t kSize>
  void add(std::string_view, const Columns<kSize>&,
           const std::optional<std::array<double, kSize>>& values) {
    for (std::size_t i = 0; i < kSize; ++i) {
      if (values) put_value((*values)[i]);
      put(',');
    }
  }
  template <std::size_t kSize>
  void add_object(std::string_view name, const Columns<kSize>& keys,
                  const std::optional<std::array<double, kSize>>& values) {
    add(name, keys, values);
  }
  [[nodiscard]] std::string line() { return take("\n"); }
};

class CsvHeader : public Text {
 public:
  CsvHeader() : Text("") {}

  template <class T>
  void add(std::string_view name, const T&) {
    put(name);
    put(',');
  }
  template <std::size_t kSize, class T>
  void add(std::string_view, const Columns<kSize>& columns, const T&) {
    for (const char* column : columns) add(column, nullptr);
  }
  template <std::size_t kSize, class T>
  void add_object(std::string_view name, const Columns<kSize>& keys, const T&) {
    for (const char* key : keys) {
      put(name);
      put('_');
      add(key, nullptr);
    }
  }
  [[nodiscard]] std::string line() { return take("\n"); }
};

template <class Line>
std::string line_of(const OrientationRecord& record) {
  Line line;
  add_fields(record, &line);
  return line.line();
}

}  // namespace

std::string json_line(const OrientationRecord& record) { return line_of<JsonLine>(record); }

std::string csv_header() { return line_of<CsvHeader>(OrientationRecord()); }

std::string csv_line(const OrientationRecord& record) { return line_of<CsvLine>(record); }

}  // namespace alidade

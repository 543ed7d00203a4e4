#include "edge_app/output/record_format.h"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace alidade {
namespace {

constexpr double kReferenceRow = 0;         // angles, rates and q hold at this row
constexpr std::size_t kLongestLine = 2048;  // bytes; most lines are not longer

template <std::size_t kSize>
using Columns = std::array<const char*, kSize>;
constexpr Columns<4> kQ = {"q_x", "q_y", "q_z", "q_w"};
constexpr Columns<2> kCentre = {"centre_offset_u_px", "centre_offset_v_px"};
// Members of the object "localized" in JSON; in CSV columns with the prefix "localized_".
constexpr Columns<2> kLocalized = {"age_s", "sigma_rad"};
constexpr Columns<3> kSigma = {"orientation_sigma_rad_0", "orientation_sigma_rad_1",
                               "orientation_sigma_rad_2"};
constexpr Columns<9> kCovariance = {
    "orientation_covariance_rad2_0", "orientation_covariance_rad2_1",
    "orientation_covariance_rad2_2", "orientation_covariance_rad2_3",
    "orientation_covariance_rad2_4", "orientation_covariance_rad2_5",
    "orientation_covariance_rad2_6", "orientation_covariance_rad2_7",
    "orientation_covariance_rad2_8"};

// Adds all fields in their order: line->add(name, value), or line->add(name, columns, values).
template <class Line>
void add_fields(const OrientationRecord& record, Line* line) {
  using Orientation = OrientationRecord::Orientation;
  // A member of the orientation; empty without an orientation.
  const auto of_orientation = [&record](auto member) {
    using Member = std::decay_t<decltype(std::declval<Orientation>().*member)>;
    return record.orientation ? std::optional<Member>((*record.orientation).*member) : std::nullopt;
  };
  line->add("frame", record.frame);
  line->add("time_s", record.time_s);
  line->add("receive_time_s", record.receive_time_s);
  line->add("mode", std::string_view(to_string(record.mode)));
  line->add("status", std::string_view(to_string(record.status)));
  line->add("calibrated", record.calibrated);
  line->add("calibration", std::string_view(to_string(record.calibration.activity)));
  std::optional<std::string_view> needs;
  if (record.calibration.need != CalibrationNeed::kNothing)
    needs = to_string(record.calibration.need);
  line->add("needs", needs);
  line->add("pan_rad", of_orientation(&Orientation::pan_rad));
  line->add("tilt_rad", of_orientation(&Orientation::tilt_rad));
  line->add("pan_rate_rad_s", of_orientation(&Orientation::pan_rate_rad_s));
  line->add("tilt_rate_rad_s", of_orientation(&Orientation::tilt_rate_rad_s));
  line->add("pan_acceleration_rad_s2", of_orientation(&Orientation::pan_acceleration_rad_s2));
  line->add("tilt_acceleration_rad_s2", of_orientation(&Orientation::tilt_acceleration_rad_s2));
  line->add("q_base_from_camera", kQ, of_orientation(&Orientation::q_base_from_camera));
  line->add("orientation_sigma_rad", kSigma, of_orientation(&Orientation::sigma_rad));
  line->add("orientation_covariance_rad2", kCovariance,
            of_orientation(&Orientation::covariance_rad2));
  line->add("reference_row", kReferenceRow);
  line->add("landmarks", std::int64_t{record.landmarks});
  line->add("residual_px", record.residual_px);
  line->add("line_delay_s", record.camera.line_delay);
  line->add("focal_length_px", record.camera.focal_length);
  line->add("focal_length_sigma_px", std::sqrt(record.camera.covariance[0]));
  line->add("aspect", record.camera.aspect);
  line->add("radial_distortion", record.camera.radial_distortion);
  line->add("centre_offset_px", kCentre,
            std::optional(std::array<double, 2>{record.camera.centre_u, record.camera.centre_v}));
  line->add("latency_s", record.latency_s);
  line->add("telemetry_age_s", record.telemetry_age_s);
  line->add("zoom", record.zoom);
  std::optional<double> zoom_rate;
  std::optional<double> zoom_rate_sigma;
  if (record.orientation && record.orientation->geometry.zoom_rate_sigma > 0) {
    zoom_rate = record.orientation->geometry.zoom_rate;
    zoom_rate_sigma = record.orientation->geometry.zoom_rate_sigma;
  }
  line->add("zoom_rate_per_s", zoom_rate);
  line->add("zoom_rate_sigma_per_s", zoom_rate_sigma);
  std::optional<std::array<double, 2>> localized;
  if (record.localized) localized = {{record.localized->age_s, record.localized->sigma_rad}};
  line->add_object("localized", kLocalized, localized);
  line->add("time_sigma_s", record.time_s ? std::optional(record.time_sigma_s) : std::nullopt);
}

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

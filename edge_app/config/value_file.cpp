#include "edge_app/config/value_file.h"

#include <cmath>
#include <filesystem>

#include "core/model/lens/distortion.h"
#include "edge_app/config/yaml_section.h"

namespace alidade {
namespace {

std::optional<StatedValue> stated_value(YamlSection& top, const char* name,
                                        const NumberRange& range) {
  if (!top.has(name)) return std::nullopt;
  YamlSection section = top.section(name);
  const std::optional<double> value = section.number("value", range);
  if (!value) section.fail_missing("value", "write {value: ..., sigma: ...}");
  StatedValue stated{*value, section.number("sigma", {0, range.high - range.low, range.unit})};
  section.finish();
  return stated;
}

std::optional<Vector3<double>> axis(YamlSection& top, const char* name) {
  if (!top.has(name)) return std::nullopt;
  YamlSection section = top.section(name);
  const auto value = section.numbers("value", 3, {-1.001, 1.001, "1"});
  if (!value) section.fail_missing("value", "write {value: [x, y, z]}");
  static_cast<void>(section.numbers("sigma", 2, {0, 1, "rad"}));
  section.finish();
  const Vector3<double> axis((*value)[0], (*value)[1], (*value)[2]);
  if (std::abs(axis.norm() - 1) > 1e-3) section.fail("value", "is not a unit vector");
  return axis.normalized();
}

void read_values(YamlSection& top, CalibrationValues* values) {
  static_cast<void>(top.integer("format", {1, 1, "1"}));
  if (top.has("image")) {
    YamlSection image = top.section("image");
    static_cast<void>(image.integer("width", {1, 1e5, "px"}));
    static_cast<void>(image.integer("height", {1, 1e5, "px"}));
    image.finish();
  }
  values->focal_length = stated_value(top, "focal_length", {1, 1e7, "px"});
  values->aspect = stated_value(top, "aspect", {0.5, 2, "1"});
  static_assert(kDistortionCount == 1, "a key for each term");
  values->radial_distortion = stated_value(top, "radial_distortion", {-1e12, 1e12, "1"});
  values->line_delay = stated_value(top, "line_delay", {-1e-3, 1e-3, "s/row"});
  values->clock_offset = stated_value(top, "clock_offset", {-10, 10, "s"});
  values->pan_scale = stated_value(top, "pan_scale", {0.5, 2, "1"});
  values->tilt_scale = stated_value(top, "tilt_scale", {0.5, 2, "1"});
  values->pan_axis = axis(top, "pan_axis");
  values->tilt_axis = axis(top, "tilt_axis");
  // Another program's notes on its own run: accepted, not used.
  static_cast<void>(top.number("cpu_s", {0, 1e9, "s"}));
  static_cast<void>(top.number("mean_pixel_error_px", {0, 1e9, "px"}));
  top.finish();
}

void read_limits(YamlSection& top, CalibrationLimits* limits) {
  limits->focal_length_rel = top.number("focal_length_rel", {1e-12, 1, "1"});
  limits->radial_distortion = top.number("radial_distortion", {1e-12, 1e12, "1"});
  limits->clock_offset_s = top.number("clock_offset_s", {1e-12, 1, "s"});
  limits->line_delay_s = top.number("line_delay_s", {1e-15, 1e-3, "s/row"});
  top.finish();
}

}  // namespace

bool parse_values(const std::string& text, const std::string& name, CalibrationValues* values,
                  std::string* error) {
  *values = CalibrationValues();
  return parse_yaml(
      text, name, [values](YamlSection& top) { read_values(top, values); }, error);
}

bool load_values(const std::string& path, CalibrationValues* values, std::string* error) {
  *values = CalibrationValues();
  if (!std::filesystem::exists(path)) return true;
  return read_yaml_file(
      path, [values](YamlSection& top) { read_values(top, values); }, error);
}

bool parse_limits(const std::string& text, const std::string& name, CalibrationLimits* limits,
                  std::string* error) {
  *limits = CalibrationLimits();
  return parse_yaml(
      text, name, [limits](YamlSection& top) { read_limits(top, limits); }, error);
}

bool load_limits(const std::string& path, CalibrationLimits* limits, std::string* error) {
  *limits = CalibrationLimits();
  if (!std::filesystem::exists(path)) return true;
  return read_yaml_file(
      path, [limits](YamlSection& top) { read_limits(top, limits); }, error);
}

}  // namespace alidade

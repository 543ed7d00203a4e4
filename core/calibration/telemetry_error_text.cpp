#include "core/calibration/telemetry_error_text.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/calibration/number_text.h"

namespace alidade::internal {

namespace {

constexpr double kWidest_rad = 0.1;  // of a play; a wider one is in another unit

double not_negative(const EstimateReader& file, const YAML::Node& map, const char* key,
                    const std::string& prefix) {
  const YAML::Node node = file.required(map, key, prefix);
  const double value = file.number(node, prefix + key);
  if (value < 0) file.fail(node, prefix + key + " is " + node.Scalar() + "; 0 or more is needed");
  return value;
}

AngleErrorCurve read_curve(const EstimateReader& file, const std::string& name) {
  AngleErrorCurve curve;
  const YAML::Node entry = file.root()[name];
  if (!entry) return curve;
  if (!entry.IsMap()) file.fail(entry, name + " is not a map; write {knots_rad: ..., ...}");
  const std::string prefix = name + ".";
  file.check_keys(entry, {"knots_rad", "values_rad", "sigma_rad", "length_rad", "unseen_sigma_rad"},
                  prefix);
  curve.unseen_sigma_rad = not_negative(file, entry, "unseen_sigma_rad", prefix);
  if (entry["length_rad"]) curve.length_rad = not_negative(file, entry, "length_rad", prefix);
  if (entry["knots_rad"] || entry["values_rad"] || entry["sigma_rad"]) {
    const YAML::Node knots = file.required(entry, "knots_rad", prefix);
    const std::string of_knots = prefix + "knots_rad.";
    if (!knots.IsMap()) {
      file.fail(knots, prefix + "knots_rad is not a map; write {first: ..., spacing: ...}");
    }
    file.check_keys(knots, {"first", "spacing"}, of_knots);
    curve.first_rad = file.number(file.required(knots, "first", of_knots), of_knots + "first");
    curve.spacing_rad = not_negative(file, knots, "spacing", of_knots);
    const YAML::Node values = file.required(entry, "values_rad", prefix);
    if (!values.IsSequence() || values.size() < 1 || values.size() > AngleErrorCurve::kMaxKnots) {
      file.fail(values, prefix + "values_rad is not a list of 1 to " +
                            std::to_string(AngleErrorCurve::kMaxKnots) + " numbers");
    }
    curve.count = static_cast<int>(values.size());
    const std::vector<double> value = file.numbers(values, prefix + "values_rad", values.size());
    const std::vector<double> sigma = file.numbers(file.required(entry, "sigma_rad", prefix),
                                                   prefix + "sigma_rad", values.size());
    std::copy(value.begin(), value.end(), curve.values.begin());
    std::copy(sigma.begin(), sigma.end(), curve.sigmas.begin());
  }
  const char* problem = nullptr;
  if (!curve.validate(&problem)) file.fail(entry, name + ": " + problem);
  return curve;
}

Play read_play(const EstimateReader& file, const std::string& name) {
  Play play;
  const YAML::Node entry = file.root()[name];
  if (!entry) return play;
  if (!entry.IsMap()) {
    file.fail(entry, name + " is not a map; write {value: ..., sigma: ..., kind: motor}");
  }
  const std::string prefix = name + ".";
  file.check_keys(entry, {"value", "sigma", "kind"}, prefix);
  play.width_rad =
      file.value(entry, name, {0, kWidest_rad, "radians, 0 or more; 0.1 degrees are 1.7e-3"});
  play.sigma_rad = not_negative(file, entry, "sigma", prefix);
  const YAML::Node kind = file.required(entry, "kind", prefix);
  const std::string text = kind.IsScalar() ? kind.Scalar() : "";
  if (text == "motor") {
    play.kind = PlayKind::kMotor;
  } else if (text == "output") {
    play.kind = PlayKind::kOutput;
  } else {
    file.fail(kind, prefix + "kind is \"" + text + "\"; motor or output is needed");
  }
  return play;
}

void write_numbers(const char* name, const AngleErrorCurve& curve,
                   const std::array<double, AngleErrorCurve::kMaxKnots>& values,
                   YAML::Emitter* out) {
  *out << YAML::Key << name << YAML::Value << YAML::BeginSeq;
  for (std::size_t i = 0; i < static_cast<std::size_t>(curve.count); ++i) {
    *out << exact_text(values[i]);
  }
  *out << YAML::EndSeq;
}

void write_curve(const char* name, const AngleErrorCurve& curve, YAML::Emitter* out) {
  if (!curve.exists()) return;
  *out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap;
  if (curve.count > 0) {
    *out << YAML::Key << "knots_rad" << YAML::Value << YAML::BeginMap << YAML::Key << "first"
         << YAML::Value << exact_text(curve.first_rad) << YAML::Key << "spacing" << YAML::Value
         << exact_text(curve.spacing_rad) << YAML::EndMap;
    write_numbers("values_rad", curve, curve.values, out);
    write_numbers("sigma_rad", curve, curve.sigmas, out);
  }
  *out << YAML::Key << "length_rad" << YAML::Value << exact_text(curve.length_rad) << YAML::Key
       << "unseen_sigma_rad" << YAML::Value << exact_text(curve.unseen_sigma_rad) << YAML::EndMap
       << YAML::Comment("rad, measured less scale x true, over the true angle");
}

void write_play(const char* name, const Play& play, YAML::Emitter* out) {
  if (!play.exists()) return;
  *out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
       << YAML::Value << exact_text(play.width_rad) << YAML::Key << "sigma" << YAML::Value
       << exact_text(play.sigma_rad) << YAML::Key << "kind" << YAML::Value
       << (play.kind == PlayKind::kMotor ? "motor" : "output") << YAML::EndMap
       << YAML::Comment("rad, backlash; the encoder is on the motor or behind the gear (output)");
}

}  // namespace

TelemetryError read_telemetry_error(const EstimateReader& file) {
  TelemetryError out;
  out.pan = read_curve(file, "pan_error");
  out.tilt = read_curve(file, "tilt_error");
  out.pan_play = read_play(file, "pan_play_rad");
  out.tilt_play = read_play(file, "tilt_play_rad");
  return out;
}

void write_telemetry_error(const TelemetryError& error, YAML::Emitter* out) {
  write_curve("pan_error", error.pan, out);
  write_curve("tilt_error", error.tilt, out);
  write_play("pan_play_rad", error.pan_play, out);
  write_play("tilt_play_rad", error.tilt_play, out);
}

}  // namespace alidade::internal

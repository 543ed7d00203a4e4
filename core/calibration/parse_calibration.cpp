#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "core/calibration/calibration_text.h"
#include "core/calibration/estimate_reader.h"
#include "core/calibration/number_text.h"
#include "core/calibration/strict_yaml.h"
#include "core/calibration/telemetry_error_text.h"
#include "core/calibration/zoom_text.h"

namespace alidade {

namespace {

EstimateRange plausible_range(Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return {1, 1e7, "pixels, more than 0"};
    case Parameter::kAspect:
      return {0.5, 2, "a ratio near 1"};
    case Parameter::kCentreU:
    case Parameter::kCentreV:
      return {-1e4, 1e4, "pixels from the image's middle, right and down"};
    case Parameter::kLineDelay:
      return {-1e-3, 1e-3, "seconds a row; 14 microseconds are 14e-6"};
    case Parameter::kPanScale:
    case Parameter::kTiltScale:
      return {0.5, 2, "measured angle / true angle, near 1"};
    case Parameter::kClockOffset:
      return {-10, 10, "seconds; 84 milliseconds are 84e-3"};
    default:
      return {-1e12, 1e12, "a plain number"};
  }
}

// Limit of a standard deviation, in the unit of the value.
double largest_sigma(Parameter parameter) {
  switch (parameter) {
    case Parameter::kPanAxis0:
    case Parameter::kPanAxis1:
    case Parameter::kTiltAxis0:
    case Parameter::kTiltAxis1:
      return 1;
    default: {
      const EstimateRange range = plausible_range(parameter);
      return range.most - range.least;
    }
  }
}

EstimateRows covariance_rows() {
  EstimateRows rows;
  for (int i = 0; i < kParameterCount; ++i) {
    const auto parameter = static_cast<Parameter>(i);
    rows.names.emplace_back(to_string(parameter));
    rows.largest_sigma.push_back(largest_sigma(parameter));
  }
  rows.known = "focal_length, aspect, ..., pan_axis_0, pan_axis_1, ..., clock_offset";
  rows.unit = "the unit of the value (axes: radians)";
  return rows;
}

class CalibrationReader {
 public:
  CalibrationReader(const YAML::Node& root, const std::string& name) : file_(root, name) {}

  Calibration read() {
    file_.check_top(
        "a calibration",
        {"format",        "image",        "focal_length",     "aspect",         "radial_distortion",
         "centre_offset", "zoom_curve",   "line_delay",       "pan_axis",       "tilt_axis",
         "pan_scale",     "tilt_scale",   "clock_offset",     "zoom",           "pan_error",
         "tilt_error",    "pan_play_rad", "tilt_play_rad",    "covariance",     "quality",
         "landmarks",     "pupil_m",      "far_focal_length", "holds_beyond_m", "centre_error"});
    const YAML::Node& root = file_.root();
    file_.read_image(&calibration_.camera.width, &calibration_.camera.height);

    calibration_.camera.focal_length = scalar(Parameter::kFocalLength);
    if (calibration_.camera.focal_length < 0.1 * calibration_.camera.width) {
      file_.fail(root["focal_length"]["value"],
                 "focal_length " + short_text(calibration_.camera.focal_length) +
                     " sees more than 157 degrees across the image; give pixels, not millimetres");
    }
    if (root["aspect"]) calibration_.camera.aspect = scalar(Parameter::kAspect);
    calibration_.camera.distortion.only_term() = scalar(Parameter::kRadialDistortion);
    if (root["centre_offset"]) calibration_.camera.set_centre_offset(centre_offset());
    if (root["centre_error"]) calibration_.centre_error = centre_error();
    calibration_.line_delay = scalar(Parameter::kLineDelay);
    calibration_.mechanics.pan_axis =
        axis("pan_axis", calibration_.mechanics.pan_axis, Parameter::kPanAxis0);
    calibration_.mechanics.tilt_axis =
        axis("tilt_axis", calibration_.mechanics.tilt_axis, Parameter::kTiltAxis0);
    calibration_.mechanics.pan_scale = scalar(Parameter::kPanScale);
    calibration_.mechanics.tilt_scale = scalar(Parameter::kTiltScale);
    calibration_.clock_offset = scalar(Parameter::kClockOffset);
    if (root["zoom"]) calibration_.zoom = file_.number(root["zoom"], "zoom");
    telemetry_error_ = internal::read_telemetry_error(file_);
    if (root["pupil_m"]) check_pupil();
    if (root["far_focal_length"]) check_far_focal_length();
    if (root["holds_beyond_m"] && !(file_.number(root["holds_beyond_m"], "holds_beyond_m") > 0)) {
      file_.fail(root["holds_beyond_m"], "holds_beyond_m is not more than 0; give metres");
    }
    if (root["quality"] && !root["quality"].IsMap()) {
      file_.fail(root["quality"], "quality is not a map; write `quality: {name: value, ...}`");
    }
    if (root["landmarks"] && !root["landmarks"].IsScalar()) {
      file_.fail(root["landmarks"], "landmarks is not a file name; write `landmarks: map.bin`");
    }
    if (root["covariance"]) covariance(root["covariance"]);
    if (root["centre_error"] &&
        calibration_.covariance.diagonal().segment<2>(index(Parameter::kCentreU)).maxCoeff() > 0) {
      file_.fail(root["centre_error"],
                 "centre_error is of a centre whose sigma is 0; leave one of both out");
    }
    if (root["zoom_curve"]) {
      if (!calibration_.zoom) {
        file_.fail(root["zoom_curve"], "zoom is missing; add the reading of focal_length");
      }
      curve_ = internal::read_zoom_curve(file_, root["zoom_curve"], calibration_);
    }
    return calibration_;
  }
  [[nodiscard]] const ZoomCurve& curve() const { return curve_; }
  [[nodiscard]] const TelemetryError& telemetry_error() const { return telemetry_error_; }

 private:
  void set_sigma(const YAML::Node& node, const std::string& name, double sigma,
                 Parameter parameter) {
    if (sigma < 0 || sigma > largest_sigma(parameter)) {
      file_.fail(
          node,
          name + ".sigma is " + short_text(sigma) +
              "; one standard deviation, in the unit of the value (axes: radians), is needed");
    }
    sigmas_.push_back({parameter, sigma, node});
    calibration_.covariance(index(parameter), index(parameter)) = sigma * sigma;
  }

  void check_pupil() const {
    const YAML::Node entry = file_.entry("pupil_m");
    for (const char* key : {"value", "sigma"}) {
      const YAML::Node node = file_.required(entry, key, "pupil_m.");
      for (const double metres : file_.numbers(node, std::string("pupil_m.") + key, 3)) {
        if (std::abs(metres) <= kFarthestPupil_m) continue;
        file_.fail(node, std::string("pupil_m.") + key + " has " + short_text(metres) +
                             "; give metres, at most " + short_text(kFarthestPupil_m));
      }
    }
  }

  void check_far_focal_length() const {
    const std::string name = "far_focal_length";
    const YAML::Node entry = file_.entry(name);
    static_cast<void>(file_.value(entry, name, plausible_range(Parameter::kFocalLength)));
    const YAML::Node sigma = file_.required(entry, "sigma", name + ".");
    if (!(file_.number(sigma, name + ".sigma") >= 0))
      file_.fail(sigma, name + ".sigma is less than 0; give px, one standard deviation");
  }

  double scalar(Parameter parameter) {
    const std::string name = to_string(parameter);
    const YAML::Node entry = file_.entry(name);
    const double value = file_.value(entry, name, plausible_range(parameter));
    if (entry["sigma"]) {
      set_sigma(entry["sigma"], name, file_.number(entry["sigma"], name + ".sigma"), parameter);
    }
    return value;
  }

  Vector3<double> axis(const std::string& name, const Vector3<double>& nominal, Parameter first) {
    const YAML::Node entry = file_.entry(name);
    const YAML::Node node = file_.required(entry, "value", name + ".");
    const std::vector<double> values = file_.numbers(node, name, 3);
    Vector3<double> axis(values[0], values[1], values[2]);
    const double norm = axis.norm();
    if (std::abs(norm - 1) > 1e-6) {
      file_.fail(node, name + " has length " + short_text(norm) + "; a unit vector is needed");
    }
    if (axis.dot(nominal) < 0.5 * norm) {
      file_.fail(node, name + " is more than 60 degrees from its nominal [" +
                           short_text(nominal.x()) + ", " + short_text(nominal.y()) + ", " +
                           short_text(nominal.z()) + "]; base axes are forward, right, down");
    }
    // Normalises what a person rounded. What a program wrote stays as it is, bit by bit.
    if (std::abs(norm - 1) > 1e-15) axis /= norm;
    set_pair_of_sigmas(entry, name, first);
    return axis;
  }

  Vector2<double> centre_offset() {
    const std::string name = "centre_offset";
    const YAML::Node entry = file_.entry(name);
    const YAML::Node node = file_.required(entry, "value", name + ".");
    const std::vector<double> values = file_.numbers(node, name, 2);
    const EstimateRange range = plausible_range(Parameter::kCentreU);
    for (const double value : values) {
      if (value < range.least || value > range.most) {
        file_.fail(node, name + " has " + short_text(value) + "; give " + range.hint);
      }
    }
    set_pair_of_sigmas(entry, name, Parameter::kCentreU);
    return {values[0], values[1]};
  }

  Matrix2<double> centre_error() {
    const std::string name = "centre_error";
    const YAML::Node entry = file_.entry(name, {"sigma", "correlation"});
    const YAML::Node node = file_.required(entry, "sigma", name + ".");
    const std::vector<double> sigma = file_.numbers(node, name + ".sigma", 2);
    for (const double each : sigma) {
      if (!(each > 0) || each > largest_sigma(Parameter::kCentreU)) {
        file_.fail(node, name + ".sigma has " + short_text(each) +
                             "; give px, more than 0, one standard deviation");
      }
    }
    const bool is_correlated = entry["correlation"].IsDefined();
    const double correlation =
        is_correlated ? file_.number(entry["correlation"], name + ".correlation") : 0;
    if (!(std::abs(correlation) < 1)) {
      file_.fail(entry["correlation"], name + ".correlation is " + short_text(correlation) +
                                           "; give more than -1 and less than 1");
    }
    const Vector2<double> own(sigma[0], sigma[1]);
    Matrix2<double> out = own * own.transpose();
    out(0, 1) *= correlation;
    out(1, 0) *= correlation;
    return out;
  }

  void set_pair_of_sigmas(const YAML::Node& entry, const std::string& name, Parameter first) {
    if (!entry["sigma"]) return;
    const YAML::Node sigma = entry["sigma"];
    const std::vector<double> pair = file_.numbers(sigma, name + ".sigma", 2);
    for (int i = 0; i < 2; ++i) {
      set_sigma(sigma, name, pair[static_cast<std::size_t>(i)],
                static_cast<Parameter>(index(first) + i));
    }
  }

  void covariance(const YAML::Node& entry) {
    file_.read_covariance(entry, covariance_rows(), calibration_.covariance);
    for (const Sigma& sigma : sigmas_) {
      file_.check_sigma(sigma.node, to_string(sigma.parameter), sigma.value,
                        calibration_.covariance(index(sigma.parameter), index(sigma.parameter)));
    }
  }

  struct Sigma {
    Parameter parameter;
    double value;
    YAML::Node node;
  };

  const EstimateReader file_;
  Calibration calibration_;
  ZoomCurve curve_;
  TelemetryError telemetry_error_;
  std::vector<Sigma> sigmas_;
};

}  // namespace

bool parse_calibration(const std::string& text, const std::string& name, Calibration* calibration,
                       std::string* error, ZoomCurve* curve, TelemetryError* telemetry_error) {
  return read_yaml(
      text, name, {"", "; valid YAML is needed"},
      [&](const YAML::Node& root) {
        CalibrationReader reader(root, name);
        *calibration = reader.read();
        if (curve != nullptr) *curve = reader.curve();
        if (telemetry_error != nullptr) *telemetry_error = reader.telemetry_error();
      },
      error);
}

}  // namespace alidade

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/calibration/calibration_text.h"
#include "core/calibration/number_text.h"
#include "core/calibration/telemetry_error_text.h"
#include "core/calibration/zoom_text.h"

namespace alidade {

namespace {

void write_quality(const CalibrationNotes& notes, YAML::Emitter* out) {
  const CalibrationQuality& quality = *notes.quality;
  const auto number = [out](const char* name, double value, const char* comment) {
    *out << YAML::Key << name << YAML::Value << short_text(value) << YAML::Comment(comment);
  };
  const auto count = [out](const char* name, int value) {
    *out << YAML::Key << name << YAML::Value << value;
  };
  const auto texts = [out](const char* name, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    *out << YAML::Key << name << YAML::Value << YAML::BeginSeq;
    for (const std::string& line : lines) *out << YAML::DoubleQuoted << line;
    *out << YAML::EndSeq;
  };
  *out << YAML::Key << "quality" << YAML::Value << YAML::BeginMap;
  number("pixel_sigma_ratio", quality.pixel_sigma_ratio, "residuals / stated noise");
  number("repetition", quality.repetition, "observations of a landmark that count as one");
  number("telemetry_sigma_ratio", quality.telemetry_sigma_ratio, "residuals / assumed noise");
  number("mean_reprojection_error_px", quality.mean_reprojection_error_px, "px");
  number("motion_correlation", quality.motion_correlation, "image motion and telemetry");
  count("frames", quality.frames);
  count("observations", quality.observations);
  count("landmarks", quality.landmarks);
  count("telemetry", quality.telemetry);
  number("condition", quality.condition, "of the parameters' correlation matrix");
  *out << YAML::Key << "weakest_direction" << YAML::Value << YAML::DoubleQuoted
       << quality.weakest_direction;
  *out << YAML::Key << "priors" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, prior] : notes.priors) {
    *out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
         << YAML::Value << exact_text(prior.value) << YAML::Key << "sigma" << YAML::Value
         << exact_text(prior.sigma) << YAML::EndMap;
  }
  *out << YAML::EndMap;
  if (quality.contradiction) {
    *out << YAML::Key << "contradiction" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
         << "parameter" << YAML::Value << quality.contradiction->parameter << YAML::Key << "between"
         << YAML::Value << quality.contradiction->between << YAML::Key << "scatter" << YAML::Value
         << short_text(quality.contradiction->scatter) << YAML::EndMap;
  }
  if (!quality.causes.empty()) {
    *out << YAML::Key << "causes" << YAML::Value << YAML::BeginSeq;
    for (const CalibrationCause& cause : quality.causes) {
      *out << YAML::Flow << YAML::BeginMap << YAML::Key << "cause" << YAML::Value << cause.cause
           << YAML::Key << "chi_square" << YAML::Value << short_text(cause.chi_square) << YAML::Key
           << "freedom" << YAML::Value << short_text(cause.freedom) << YAML::Key << "size"
           << YAML::Value << short_text(cause.size) << YAML::Key << "unit" << YAML::Value
           << cause.unit << YAML::EndMap;
    }
    *out << YAML::EndSeq;
  }
  texts("excluded", notes.excluded);
  texts("advice", quality.advice);
  *out << YAML::EndMap;
}

void write_distances(const CalibrationNotes& notes, double relative_sigma, YAML::Emitter* out) {
  const Pupil usual;
  const Pupil& pupil = notes.pupil;
  const auto write = [out](const char* name, const Vector3<double>& v) {
    *out << YAML::Key << name << YAML::Value << YAML::BeginSeq << exact_text(v.x())
         << exact_text(v.y()) << exact_text(v.z()) << YAML::EndSeq;
  };
  if (pupil.place_m != usual.place_m || pupil.sigma_m != usual.sigma_m) {
    *out << YAML::Key << "pupil_m" << YAML::Value << YAML::Flow << YAML::BeginMap;
    write("value", pupil.place_m);
    write("sigma", pupil.sigma_m);
    *out << YAML::EndMap << YAML::Comment("right, down, forward of where the axes meet");
  }
  if (notes.far_focal_length) {
    *out << YAML::Key << "far_focal_length" << YAML::Value << YAML::Flow << YAML::BeginMap
         << YAML::Key << "value" << YAML::Value << exact_text(notes.far_focal_length->value)
         << YAML::Key << "sigma" << YAML::Value << exact_text(notes.far_focal_length->sigma)
         << YAML::EndMap << YAML::Comment("px, of far things; focal_length is of what was in view");
  }
  if (const double beyond_m = holds_beyond_m(pupil, relative_sigma);
      beyond_m > 0 && std::isfinite(beyond_m)) {
    *out << YAML::Key << "holds_beyond_m" << YAML::Value << short_text(beyond_m)
         << YAML::Comment("nearer, the pupil does more than a sigma of the focal length");
  }
}

}  // namespace

std::vector<Parameter> parameters_of(const Calibration& calibration) {
  std::vector<Parameter> parameters;
  for (int i = 0; i < kParameterCount; ++i) {
    const auto parameter = static_cast<Parameter>(i);
    const bool is_centre = parameter == Parameter::kCentreU || parameter == Parameter::kCentreV;
    if (!is_centre || calibration.has_centre()) parameters.push_back(parameter);
  }
  return parameters;
}

std::string format_calibration(const Calibration& calibration, const CalibrationNotes& notes) {
  YAML::Emitter out;
  const auto& cov = calibration.covariance;
  const auto sigma = [&cov](Parameter parameter) {
    return exact_text(std::sqrt(cov(index(parameter), index(parameter))));
  };
  const auto write_scalar = [&](Parameter parameter, double value, const char* comment) {
    out << YAML::Key << to_string(parameter) << YAML::Value << YAML::Flow << YAML::BeginMap
        << YAML::Key << "value" << YAML::Value << exact_text(value) << YAML::Key << "sigma"
        << YAML::Value << sigma(parameter) << YAML::EndMap << YAML::Comment(comment);
  };
  const auto write_axis = [&](const char* name, const Vector3<double>& axis, Parameter first,
                              const char* comment) {
    out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
        << YAML::Value << YAML::BeginSeq;
    for (int i = 0; i < 3; ++i) out << exact_text(axis[i]);
    out << YAML::EndSeq << YAML::Key << "sigma" << YAML::Value << YAML::BeginSeq << sigma(first)
        << sigma(static_cast<Parameter>(index(first) + 1)) << YAML::EndSeq << YAML::EndMap
        << YAML::Comment(comment);
  };

  out << YAML::BeginMap;
  out << YAML::Key << "format" << YAML::Value << 1;
  out << YAML::Key << "image" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "width"
      << YAML::Value << std::to_string(calibration.camera.width) << YAML::Key << "height"
      << YAML::Value << std::to_string(calibration.camera.height) << YAML::EndMap;
  write_scalar(Parameter::kFocalLength, calibration.camera.focal_length, "px");
  write_scalar(Parameter::kAspect, calibration.camera.aspect, "f_v / f_u");
  write_scalar(Parameter::kRadialDistortion, calibration.camera.distortion.only_term(),
               "u = f x (1 + k |x|^2) + centre");
  const std::vector<Parameter> parameters = parameters_of(calibration);
  if (calibration.has_centre()) {
    out << YAML::Key << "centre_offset" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "value" << YAML::Value << YAML::BeginSeq << exact_text(calibration.camera.centre_u)
        << exact_text(calibration.camera.centre_v) << YAML::EndSeq << YAML::Key << "sigma"
        << YAML::Value << YAML::BeginSeq << sigma(Parameter::kCentreU) << sigma(Parameter::kCentreV)
        << YAML::EndSeq << YAML::EndMap
        << YAML::Comment("px, of the optical centre from the image's middle");
  }
  if (!calibration.centre_error.isZero(0)) {
    const Vector2<double> own = calibration.centre_error.diagonal().cwiseSqrt();
    out << YAML::Key << "centre_error" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "sigma" << YAML::Value << YAML::BeginSeq << exact_text(own.x()) << exact_text(own.y())
        << YAML::EndSeq << YAML::Key << "correlation" << YAML::Value
        << exact_text(calibration.centre_error(0, 1) / (own.x() * own.y())) << YAML::EndMap
        << YAML::Comment("px, of the optical centre, which is exact only as the frame's axis");
  }
  write_scalar(Parameter::kLineDelay, calibration.line_delay, "s/row");
  write_axis("pan_axis", calibration.mechanics.pan_axis, Parameter::kPanAxis0,
             "unit vector in the base: forward, right, down; sigma in rad");
  write_axis("tilt_axis", calibration.mechanics.tilt_axis, Parameter::kTiltAxis0,
             "unit vector in the base; sigma in rad");
  write_scalar(Parameter::kPanScale, calibration.mechanics.pan_scale, "measured / true angle");
  write_scalar(Parameter::kTiltScale, calibration.mechanics.tilt_scale, "measured / true angle");
  write_scalar(Parameter::kClockOffset, calibration.clock_offset,
               "s; telemetry clock = image clock + clock_offset");
  if (calibration.zoom) out << YAML::Key << "zoom" << YAML::Value << exact_text(*calibration.zoom);
  internal::write_telemetry_error(notes.telemetry_error, &out);
  write_distances(notes, relative_focal_length_sigma(calibration), &out);
  if (!cov.isZero(0)) {
    out << YAML::Key << "covariance" << YAML::Value << YAML::BeginMap << YAML::Key << "names"
        << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const Parameter row : parameters) out << to_string(row);
    out << YAML::EndSeq << YAML::Key << "matrix" << YAML::Value << YAML::BeginSeq;
    for (const Parameter row : parameters) {
      out << YAML::Flow << YAML::BeginSeq;
      for (const Parameter column : parameters) out << exact_text(cov(index(row), index(column)));
      out << YAML::EndSeq;
    }
    out << YAML::EndSeq << YAML::EndMap;
  }
  if (!notes.zoom_curve.empty()) {
    out << YAML::Key << "zoom_curve" << YAML::Value;
    internal::write_zoom_curve(notes.zoom_curve, &out);
  }
  if (notes.quality) write_quality(notes, &out);
  if (!notes.landmarks.empty()) {
    out << YAML::Key << "landmarks" << YAML::Value << YAML::DoubleQuoted << notes.landmarks;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace alidade

#include "edge_app/output/calibration_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace alidade {

using nlohmann::ordered_json;

ordered_json parameters_json(const Calibration& calibration) {
  ordered_json parameters;
  const auto sigma = [&](int parameter) {
    return std::sqrt(calibration.covariance(parameter, parameter));
  };
  const auto scalar = [&](Parameter parameter, double value) {
    parameters[to_string(parameter)] = {{"value", value}, {"sigma", sigma(index(parameter))}};
  };
  const auto axis = [&](const char* name, const Vector3<double>& value, Parameter first) {
    parameters[name] = {{"value", {value.x(), value.y(), value.z()}},
                        {"sigma", {sigma(index(first)), sigma(index(first) + 1)}}};
  };
  scalar(Parameter::kFocalLength, calibration.camera.focal_length);
  scalar(Parameter::kAspect, calibration.camera.aspect);
  scalar(Parameter::kRadialDistortion, calibration.camera.radial_distortion);
  scalar(Parameter::kLineDelay, calibration.line_delay);
  axis("pan_axis", calibration.mechanics.pan_axis, Parameter::kPanAxis0);
  axis("tilt_axis", calibration.mechanics.tilt_axis, Parameter::kTiltAxis0);
  scalar(Parameter::kPanScale, calibration.mechanics.pan_scale);
  scalar(Parameter::kTiltScale, calibration.mechanics.tilt_scale);
  scalar(Parameter::kClockOffset, calibration.clock_offset);
  return parameters;
}

ordered_json calibration_json(const Calibration& calibration) {
  ordered_json json{
      {"format", 1},
      {"image", {{"width", calibration.camera.width}, {"height", calibration.camera.height}}}};
  json.update(parameters_json(calibration));
  if (calibration.zoom) json["zoom"] = *calibration.zoom;
  ordered_json names = ordered_json::array();
  ordered_json matrix = ordered_json::array();
  for (int i = 0; i < kParameterCount; ++i) {
    names.push_back(to_string(static_cast<Parameter>(i)));
    ordered_json row = ordered_json::array();
    for (int j = 0; j < kParameterCount; ++j) row.push_back(calibration.covariance(i, j));
    matrix.push_back(std::move(row));
  }
  json["covariance"] = {{"names", std::move(names)}, {"matrix", std::move(matrix)}};
  return json;
}

}  // namespace alidade

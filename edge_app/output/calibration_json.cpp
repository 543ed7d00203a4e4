#include "edge_app/output/calibration_json.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/calibration/calibration_text.h"

namespace alidade {

using nlohmann::ordered_json;

ordered_json parameters_json(const Calibration& calibration) {
  ordered_json parameters;
  const auto sigma = [&](Parameter parameter) { return parameter_sigma(calibration, parameter); };
  const auto scalar = [&](Parameter parameter) {
    parameters[to_string(parameter)] = {{"value", parameter_value(calibration, parameter)},
                                        {"sigma", sigma(parameter)}};
  };
  const auto axis = [&](const char* name, const Vector3<double>& value, Parameter first) {
    parameters[name] = {{"value", {value.x(), value.y(), value.z()}},
                        {"sigma", {sigma(first), sigma(static_cast<Parameter>(index(first) + 1))}}};
  };
  scalar(Parameter::kFocalLength);
  scalar(Parameter::kAspect);
  for (int i = 0; i < kDistortionCount; ++i) scalar(distortion_parameter(i));
  if (calibration.has_centre()) {
    parameters["centre_offset"] = {
        {"value", {calibration.camera.centre_u, calibration.camera.centre_v}},
        {"sigma", {sigma(Parameter::kCentreU), sigma(Parameter::kCentreV)}}};
  }
  if (const Matrix2<double>& V = calibration.centre_error; !V.isZero(0)) {
    parameters["centre_error"] = {{"sigma", {std::sqrt(V(0, 0)), std::sqrt(V(1, 1))}},
                                  {"correlation", V(0, 1) / std::sqrt(V(0, 0) * V(1, 1))}};
  }
  scalar(Parameter::kLineDelay);
  axis("pan_axis", calibration.mechanics.pan_axis, Parameter::kPanAxis0);
  axis("tilt_axis", calibration.mechanics.tilt_axis, Parameter::kTiltAxis0);
  scalar(Parameter::kPanScale);
  scalar(Parameter::kTiltScale);
  scalar(Parameter::kClockOffset);
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
  const std::vector<Parameter> parameters = parameters_of(calibration);
  for (const Parameter row : parameters) {
    names.push_back(to_string(row));
    ordered_json values = ordered_json::array();
    for (const Parameter column : parameters) {
      values.push_back(calibration.covariance(index(row), index(column)));
    }
    matrix.push_back(std::move(values));
  }
  json["covariance"] = {{"names", std::move(names)}, {"matrix", std::move(matrix)}};
  return json;
}

ordered_json telemetry_error_json(const TelemetryError& error) {
  constexpr int kSamples = 241;
  ordered_json json = ordered_json::object();
  const auto add_curve = [&json](const char* name, const AngleErrorCurve& curve) {
    if (!curve.exists()) return;
    ordered_json& out = json[name];
    if (curve.count > 0) {
      out["knots_rad"] = {{"first", curve.first_rad}, {"spacing", curve.spacing_rad}};
      ordered_json samples{{"angle_rad", ordered_json::array()},
                           {"error_rad", ordered_json::array()},
                           {"sigma_rad", ordered_json::array()}};
      const int count = curve.count > 1 ? kSamples : 1;
      for (int i = 0; i < count; ++i) {
        const double angle = curve.first_rad + curve.extent_rad() * i / (kSamples - 1);
        samples["angle_rad"].push_back(angle);
        samples["error_rad"].push_back(curve.at(angle));
        samples["sigma_rad"].push_back(curve.sigma(angle));
      }
      const auto first = [&curve](const std::array<double, AngleErrorCurve::kMaxKnots>& all) {
        return std::vector<double>(all.begin(), all.begin() + curve.count);
      };
      out["values_rad"] = first(curve.values);
      out["sigma_rad"] = first(curve.sigmas);
      out["samples"] = std::move(samples);
    }
    out["length_rad"] = curve.length_rad;
    out["unseen_sigma_rad"] = curve.unseen_sigma_rad;
  };
  const auto add_play = [&json](const char* name, const Play& play) {
    if (!play.exists()) return;
    json[name] = {{"value", play.width_rad},
                  {"sigma", play.sigma_rad},
                  {"kind", play.kind == PlayKind::kMotor ? "motor" : "output"}};
  };
  add_curve("pan_error", error.pan);
  add_curve("tilt_error", error.tilt);
  add_play("pan_play_rad", error.pan_play);
  add_play("tilt_play_rad", error.tilt_play);
  return json;
}

ordered_json zoom_curve_json(const ZoomCurve& curve) {
  constexpr int kSamples = 41;
  const ZoomCurve::Content& content = curve.content();
  ordered_json nodes = ordered_json::array();
  for (int i = 0; i < content.nodes; ++i) {
    if (content.is_between[static_cast<std::size_t>(i)]) continue;  // the samples show it
    const ordered_json all = parameters_json(curve.node(i));
    ordered_json node{{"reading", content.reading[static_cast<std::size_t>(i)]}};
    const auto take = [&](const char* name) {
      if (all.contains(name)) node[name] = all[name];
    };
    take(to_string(Parameter::kFocalLength));
    for (const char* name : Distortion<double>::kNames) take(name);
    take("centre_offset");
    nodes.push_back(std::move(node));
  }
  ordered_json readings = ordered_json::array();
  ordered_json focal_lengths = ordered_json::array();
  ordered_json sigmas = ordered_json::array();
  for (int i = 0; i < kSamples; ++i) {
    const double share = static_cast<double>(i) / (kSamples - 1);
    const double reading =
        curve.first_reading() + share * (curve.last_reading() - curve.first_reading());
    Calibration c;
    if (!curve.at(reading, &c)) continue;
    readings.push_back(reading);
    focal_lengths.push_back(c.camera.focal_length);
    sigmas.push_back(parameter_sigma(c, Parameter::kFocalLength));
  }
  return {{"repeatability", content.repeatability},
          {"nodes", std::move(nodes)},
          {"samples",
           {{"reading", std::move(readings)},
            {"focal_length_px", std::move(focal_lengths)},
            {"focal_length_sigma_px", std::move(sigmas)}}}};
}

}  // namespace alidade

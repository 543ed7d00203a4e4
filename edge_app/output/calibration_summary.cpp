#include "edge_app/output/calibration_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/calibration/number_text.h"
#include "edge_app/output/calibration_json.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

std::string prior_text(const std::optional<CalibrationPrior>& prior, double unit) {
  if (!prior) return "none";
  const double sigma = prior->sigma / unit;
  const std::string value = value_text(prior->value / unit, sigma);
  return value + (sigma > 0 ? " ± " : ", ") + sigma_text(sigma);
}

SummaryRow scalar_row(const Calibration& calibration, Parameter parameter, double value,
                      double unit, const char* unit_name,
                      const std::optional<CalibrationPrior>& prior) {
  const double sigma = parameter_sigma(calibration, parameter) / unit;
  return {to_string(parameter), value_text(value / unit, sigma), sigma_text(sigma), unit_name,
          prior_text(prior, unit)};
}

SummaryRow axis_row(const Calibration& calibration, const char* name, const Vector3<double>& axis,
                    Parameter first, double prior_sigma) {
  constexpr double kMilli = 1e-3;
  const double s0 = parameter_sigma(calibration, first);
  const double s1 = parameter_sigma(calibration, static_cast<Parameter>(index(first) + 1));
  const double least = s0 > 0 && s1 > 0 ? std::min(s0, s1) : std::max(s0, s1);
  std::string value;
  for (int i = 0; i < 3; ++i) value += (i == 0 ? "" : " ") + value_text(axis[i], least);
  return {name, value, sigma_text(s0 / kMilli) + ", " + sigma_text(s1 / kMilli),
          "unit vector, mrad",
          prior_sigma > 0 ? fmt::format("nominal ± {:.3g}", prior_sigma / kMilli)
                          : std::string("nominal, exact")};
}

// Counts characters, not bytes: a prior has a plus-minus sign.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

std::string pad(const std::string& text, std::size_t width) {
  return text + std::string(width - std::min(width, width_of(text)), ' ');
}

}  // namespace

std::vector<SummaryRow> summary_rows(const CalibrationResult& result,
                                     const CalibrationOptions& options) {
  const Calibration& c = result.calibration;
  const auto& m = c.mechanics;
  std::vector<SummaryRow> rows = {
      scalar_row(c, Parameter::kFocalLength, c.camera.focal_length, 1, "px", options.focal_length),
      scalar_row(c, Parameter::kAspect, c.camera.aspect, 1, "1", options.aspect),
      scalar_row(c, Parameter::kRadialDistortion, c.camera.distortion.only_term(), 1, "1",
                 options.radial_distortion),
      scalar_row(c, Parameter::kLineDelay, c.line_delay, 1e-6, "us/row", options.line_delay),
      axis_row(c, "pan_axis", m.pan_axis, Parameter::kPanAxis0, options.axis_sigma_rad),
      axis_row(c, "tilt_axis", m.tilt_axis, Parameter::kTiltAxis0, options.axis_sigma_rad),
      scalar_row(c, Parameter::kPanScale, m.pan_scale, 1, "1", options.pan_scale),
      scalar_row(c, Parameter::kTiltScale, m.tilt_scale, 1, "1", options.tilt_scale),
      scalar_row(c, Parameter::kClockOffset, c.clock_offset, 1e-3, "ms", options.clock_offset)};
  if (c.has_centre()) {
    const CalibrationPrior u{options.centre_offset_px.x(), options.centre_sigma_px};
    const CalibrationPrior v{options.centre_offset_px.y(), options.centre_sigma_px};
    Calibration with_error = c;
    with_error.covariance.block<2, 2>(index(Parameter::kCentreU), index(Parameter::kCentreU)) +=
        c.centre_error;
    rows.insert(rows.begin() + 3,
                {scalar_row(with_error, Parameter::kCentreU, c.camera.centre_u, 1, "px", u),
                 scalar_row(with_error, Parameter::kCentreV, c.camera.centre_v, 1, "px", v)});
  }
  return rows;
}

std::string taken_for_granted(const CalibrationResult& result, const CalibrationOptions& options) {
  constexpr double kStep_s = 0.05;
  constexpr double kDegree = kPi / 180;
  const TrajectorySpline& trajectory = result.trajectory;
  const double sigma = relative_focal_length_sigma(result.calibration);
  if (options.angle_accuracy_rad > 0 || !(sigma > 0) || trajectory.segments() < 1) return {};
  double least = trajectory.position(trajectory.begin_s()).pan;
  double largest = least;
  const double span_s = trajectory.end_s() - trajectory.begin_s();
  const int steps = static_cast<int>(span_s / kStep_s);
  for (int i = 1; i <= steps; ++i) {
    const double pan = trajectory.position(trajectory.begin_s() + i * kStep_s).pan;
    least = std::min(least, pan);
    largest = std::max(largest, pan);
  }
  const double range = largest - least;
  return fmt::format("a head exact to {:.2g} degrees over {:.2g} degrees", sigma * range / kDegree,
                     range / kDegree);
}

std::string holds_beyond(const CalibrationResult& result, const CalibrationOptions& options) {
  const double beyond_m =
      holds_beyond_m(options.pupil, relative_focal_length_sigma(result.calibration));
  if (!(beyond_m > 0) || !std::isfinite(beyond_m)) return {};
  const double digit_m = std::pow(10, std::floor(std::log10(beyond_m)) - 1);
  return fmt::format(
      "things farther than {:g} m: nearer, a lens's pupil {:.2g} cm before or behind the axes does "
      "more than one sigma of the focal length",
      digit_m * std::round(beyond_m / digit_m),
      100 * (std::abs(options.pupil.place_m.z()) + options.pupil.sigma_m.z()));
}

std::string far_focal_length_text(const CalibrationResult& result) {
  const auto far = result.far_focal_length();
  return far ? estimate_text(far->value, far->sigma, "px") : "";
}

std::string summary_text(const CalibrationResult& result, const CalibrationOptions& options) {
  std::vector<SummaryRow> rows = {{"parameter", "value", "sigma", "unit", "prior"}};
  const std::vector<SummaryRow> parameters = summary_rows(result, options);
  rows.insert(rows.end(), parameters.begin(), parameters.end());
  std::size_t widths[4] = {};
  for (const SummaryRow& row : rows) {
    const std::string* cells[] = {&row.parameter, &row.value, &row.sigma, &row.unit};
    for (std::size_t i = 0; i < 4; ++i) widths[i] = std::max(widths[i], width_of(*cells[i]));
  }
  std::string text;
  for (const SummaryRow& row : rows) {
    text += fmt::format("{}  {}  {}  {}  {}\n", pad(row.parameter, widths[0]),
                        pad(row.value, widths[1]), pad(row.sigma, widths[2]),
                        pad(row.unit, widths[3]), row.prior);
  }
  const CalibrationQuality& quality = result.quality;
  text += fmt::format(
      "from {}, {} of {}, {}; "
      "residuals / noise: image {:.2f}, telemetry {:.2f}\n",
      counted(quality.frames, "frame"), counted(quality.observations, "observation"),
      counted(quality.landmarks, "landmark"), counted(quality.telemetry, "telemetry sample"),
      quality.pixel_sigma_ratio, quality.telemetry_sigma_ratio);
  if (quality.repetition > 1.1) {
    text += fmt::format(
        "image errors repeat from frame to frame: {:.1f} observations of a landmark count as one\n",
        quality.repetition);
  }
  for (const std::string& line : telemetry_error_lines(result.telemetry_error)) {
    text += "telemetry is off, " + line + "\n";
  }
  for (const std::string& line : result.exclusions.describe()) text += "left out: " + line + "\n";
  text +=
      fmt::format("weakest: {} (condition {:.3g})\n", quality.weakest_direction, quality.condition);
  for (const std::string& line : quality.describe_departures()) {
    text += "contradicts the model: " + line + "\n";
  }
  if (const std::string granted = taken_for_granted(result, options); !granted.empty())
    text += "focal length's sigma takes for granted: " + granted + "\n";
  if (const std::string beyond = holds_beyond(result, options); !beyond.empty())
    text += "holds for " + beyond + "\n";
  if (const std::string far = far_focal_length_text(result); !far.empty())
    text += "focal length of far things, as scene and pupil tell: " + far + "\n";
  for (const std::string& line : quality.advice) text += "advice: " + line + "\n";
  return text;
}

std::vector<std::string> telemetry_error_lines(const TelemetryError& error) {
  constexpr double kMilli = 1e3;
  const auto line = [](const char* axis, const AngleErrorCurve& curve, const Play& play) {
    std::string text;
    if (curve.count > 0) {
      double square = 0;
      double known = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(curve.count); ++i) {
        square += curve.values[i] * curve.values[i];
        known += curve.sigmas[i] * curve.sigmas[i];
      }
      text = fmt::format(
          "{:.3f} mrad (RMS) over {:.1f} degrees, known to {:.3f}; elsewhere {:.3f} of it is "
          "possible",
          kMilli * std::sqrt(square / curve.count), curve.extent_rad() * 180 / kPi,
          kMilli * std::sqrt(known / curve.count), kMilli * curve.unseen_sigma_rad);
    } else if (curve.exists()) {
      text = fmt::format("up to {:.3f} mrad (one sigma), of unknown course",
                         kMilli * curve.unseen_sigma_rad);
    }
    if (play.exists()) {
      text +=
          fmt::format("{}play of {:.3f} +- {:.3f} mrad, the encoder {}", text.empty() ? "" : "; ",
                      kMilli * play.width_rad, kMilli * play.sigma_rad,
                      play.kind == PlayKind::kMotor ? "on the motor" : "behind the gear");
    }
    return text.empty() ? text : std::string(axis) + ": " + text;
  };
  std::vector<std::string> lines = {line("pan", error.pan, error.pan_play),
                                    line("tilt", error.tilt, error.tilt_play)};
  lines.erase(std::remove(lines.begin(), lines.end(), std::string()), lines.end());
  return lines;
}

std::string summary_json(const CalibrationResult& result, const CalibrationOptions& options,
                         const std::vector<std::pair<std::string, std::string>>& files) {
  using nlohmann::ordered_json;
  ordered_json json;
  json["status"] = to_string(result.status);
  json["message"] = result.message;
  json["calibration"] = parameters_json(result.calibration);
  json["calibration"].update(telemetry_error_json(result.telemetry_error));
  for (const auto& [name, prior] : stated_priors(options)) {
    json["priors"][name] = {{"value", prior.value}, {"sigma", prior.sigma}};
  }
  const CalibrationQuality& quality = result.quality;
  json["quality"] = {{"pixel_sigma_ratio", quality.pixel_sigma_ratio},
                     {"telemetry_sigma_ratio", quality.telemetry_sigma_ratio},
                     {"mean_reprojection_error_px", quality.mean_reprojection_error_px},
                     {"frames", quality.frames},
                     {"observations", quality.observations},
                     {"landmarks", quality.landmarks},
                     {"telemetry", quality.telemetry},
                     {"motion_correlation", quality.motion_correlation},
                     {"condition", quality.condition},
                     {"weakest_direction", quality.weakest_direction},
                     {"advice", quality.advice}};
  if (quality.contradiction) {
    json["quality"]["contradiction"] = {{"parameter", quality.contradiction->parameter},
                                        {"between", quality.contradiction->between},
                                        {"scatter", quality.contradiction->scatter}};
  }
  json["quality"]["causes"] = ordered_json::array();
  for (const CalibrationCause& cause : quality.causes) {
    json["quality"]["causes"].push_back({{"cause", cause.cause},
                                         {"chi_square", cause.chi_square},
                                         {"freedom", cause.freedom},
                                         {"size", cause.size},
                                         {"unit", cause.unit}});
  }
  if (const std::string granted = taken_for_granted(result, options); !granted.empty())
    json["taken_for_granted"] = granted;
  if (const double beyond_m =
          holds_beyond_m(options.pupil, relative_focal_length_sigma(result.calibration));
      beyond_m > 0 && std::isfinite(beyond_m))
    json["holds_beyond_m"] = beyond_m;
  if (const auto far = result.far_focal_length())
    json["far_focal_length"] = {{"value", far->value}, {"sigma", far->sigma}};
  json["excluded"] = result.exclusions.describe();
  json["files"] = ordered_json::object();
  for (const auto& [kind, path] : files) json["files"][kind] = path;
  // A folder name need not be UTF-8.
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::vector<std::pair<std::string, CalibrationPrior>> stated_priors(
    const CalibrationOptions& options) {
  std::vector<std::pair<std::string, CalibrationPrior>> priors;
  const auto add = [&priors](Parameter parameter, const std::optional<CalibrationPrior>& prior) {
    if (prior) priors.emplace_back(to_string(parameter), *prior);
  };
  add(Parameter::kFocalLength, options.focal_length);
  add(Parameter::kAspect, options.aspect);
  static_assert(kDistortionCount == 1, "the prior of each term");
  add(Parameter::kRadialDistortion, options.radial_distortion);
  if (options.centre_sigma_px > 0) {
    add(Parameter::kCentreU,
        CalibrationPrior{options.centre_offset_px.x(), options.centre_sigma_px});
    add(Parameter::kCentreV,
        CalibrationPrior{options.centre_offset_px.y(), options.centre_sigma_px});
  }
  add(Parameter::kLineDelay, options.line_delay);
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    add(axis, CalibrationPrior{0, options.axis_sigma_rad});
  }
  add(Parameter::kPanScale, options.pan_scale);
  add(Parameter::kTiltScale, options.tilt_scale);
  add(Parameter::kClockOffset, options.clock_offset);
  return priors;
}

}  // namespace alidade

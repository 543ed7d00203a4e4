#include "edge_app/commands/calibrate_zooms.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/calibration/zoom_fit.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/commands/visible_calibration.h"
#include "edge_app/output/calibration_json.h"
#include "edge_app/output/calibration_report.h"
#include "edge_app/output/zoom_report.h"
#include "edge_app/storage/calibration_file.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

// A value that holds at one zoom only cannot be a prior for several.
void refuse_priors_of_one_zoom(const CalibrateOptions& options, std::size_t stretches) {
  const auto refuse = [stretches](const char* option, const std::string& text) {
    if (text.empty()) return;
    throw CommandError(kExitUsage,
                       fmt::format("{} is valid at one zoom only, but there are {} stretches of "
                                   "constant zoom; leave it out, or give one recording at one zoom",
                                   option, stretches));
  };
  refuse("--focal-length", options.focal_length);
  refuse("--radial-distortion", options.radial_distortion);
  if (options.centre_sigma_px == 0) {
    throw CommandError(kExitUsage,
                       "--centre-sigma 0: a zoom curve is made of calibrations with a free optical "
                       "centre; give more than 0 px, or leave it out");
  }
}

void require_readings(const std::vector<CalibrationJob>& jobs) {
  for (const CalibrationJob& job : jobs) {
    if (job.zoom) continue;
    throw CommandError(
        kExitUsage,
        fmt::format("{}: telemetry.csv has no zoom readings, which are needed to calibrate several "
                    "recordings together; calibrate it alone, or add the column zoom",
                    job.recording));
  }
  const auto at_other = [&](const CalibrationJob& job) { return *job.zoom != *jobs.front().zoom; };
  if (std::any_of(jobs.begin(), jobs.end(), at_other)) return;
  throw CommandError(
      kExitUsage,
      fmt::format("all {} stretches of constant zoom are of reading {:g}: recordings are "
                  "calibrated together to make a zoom curve only; calibrate the longest one alone",
                  jobs.size(), *jobs.front().zoom));
}

// Median and largest relative sigma of the focal length at readings between the first and the last,
// as it is after a movement of the zoom.
std::pair<double, double> sigmas_between(const ZoomCurve& curve) {
  constexpr int kReadings = 41;
  std::vector<double> sigmas;
  for (int i = 0; i < kReadings; ++i) {
    const double reading = curve.first_reading() +
                           (curve.last_reading() - curve.first_reading()) * (i + 0.5) / kReadings;
    Calibration c;
    if (curve.at(reading, &c)) sigmas.push_back(relative_focal_length_sigma(c));
  }
  std::sort(sigmas.begin(), sigmas.end());
  if (sigmas.empty()) return {0, 0};
  return {sigmas[sigmas.size() / 2], sigmas.back()};
}

std::string zooms_text(const ZoomFit& fit, const std::vector<Calibration>& nodes,
                       std::size_t movements) {
  std::string text = fmt::format("{:>10}  {:>12}  {:>9}  {:>12}  {:>9}  {:>16}  {:>13}\n",
                                 "reading", "f, px", "sigma", "k", "sigma", "centre, px", "sigma");
  for (const Calibration& c : nodes) {
    const double f = parameter_sigma(c, Parameter::kFocalLength);
    const double k = parameter_sigma(c, Parameter::kRadialDistortion);
    const double u = parameter_sigma(c, Parameter::kCentreU);
    const double v = parameter_sigma(c, Parameter::kCentreV);
    text += fmt::format("{:>10g}  {:>12}  {:>9}  {:>12}  {:>9}  {:>16}  {:>13}\n", *c.zoom,
                        value_text(c.camera.focal_length, f), sigma_text(f),
                        value_text(c.camera.distortion.only_term(), k), sigma_text(k),
                        value_text(c.camera.centre_u, u) + ", " + value_text(c.camera.centre_v, v),
                        sigma_text(u) + ", " + sigma_text(v));
  }
  const Calibration& any = nodes.front();
  const auto line = [&](const char* name, double value, Parameter p, double unit, const char* of) {
    const double sigma = parameter_sigma(any, p) / unit;
    text += fmt::format("{}  {}\n", name, estimate_text(value / unit, sigma, of));
  };
  line("line_delay", any.line_delay, Parameter::kLineDelay, 1e-6, "us/row");
  line("clock_offset", any.clock_offset, Parameter::kClockOffset, 1e-3, "ms");
  text += fmt::format(
      "chi-square of what all readings share: {:.1f}, {} expected; after a movement f may be "
      "{:.2g} % off\n",
      fit.chi_square, fit.degrees_of_freedom, 100 * fit.curve.content().repeatability);
  const auto [usual, largest] = sigmas_between(fit.curve);
  text += fmt::format(
      "between readings f is known to {:.2g} % (median), {:.2g} % (worst), from {}\n", 100 * usual,
      100 * largest, counted(static_cast<std::int64_t>(movements), "movement"));
  return text;
}

std::string zooms_json(const ZoomFit& fit, const std::vector<Calibration>& nodes,
                       std::size_t movements, const OutputDirectory& directory) {
  using nlohmann::ordered_json;
  ordered_json json;
  json["status"] = "ok";
  json["calibration"] = parameters_json(nodes.front());
  json["zooms"] = ordered_json::array();
  for (const Calibration& c : nodes) {
    ordered_json node = parameters_json(c);
    node["zoom"] = *c.zoom;
    json["zooms"].push_back(std::move(node));
  }
  json["shared_chi_square"] = fit.chi_square;
  json["shared_degrees_of_freedom"] = fit.degrees_of_freedom;
  json["movements"] = movements;
  const auto [usual, largest] = sigmas_between(fit.curve);
  json["focal_length_sigma_between"] = {{"median", usual}, {"largest", largest}};
  json["advice"] = zoom_advice(fit.curve);
  json["files"] = ordered_json::object();
  for (const auto& [kind, path] : directory.files()) json["files"][kind] = path;
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

// The curve's nodes at dwells, without those between them.
std::vector<Calibration> nodes_of(const ZoomCurve& curve) {
  std::vector<Calibration> nodes;
  for (int i = 0; i < curve.content().nodes; ++i) {
    if (!curve.content().is_between[static_cast<std::size_t>(i)]) nodes.push_back(curve.node(i));
  }
  return nodes;
}

// What the tracks show while the zoom moves. calibration_of: each job's index in `calibrations`, if
// it was calibrated. Appends to *told what the report says of each of them.
std::vector<MovementObservation> observe_movements(
    const std::vector<CalibrationJob>& jobs,
    const std::vector<std::optional<std::size_t>>& calibration_of,
    const std::vector<Calibration>& calibrations, const ZoomCurve& curve,
    std::vector<ZoomReportMovement>* told) {
  std::vector<MovementObservation> observations;
  const std::vector<double> readings = readings_between(calibrations);
  for (std::size_t i = 1; i < jobs.size(); ++i) {
    const auto& movement = jobs[i].movement;
    if (!movement || !(calibration_of[i - 1] || calibration_of[i])) continue;
    MovementObservation observation;
    std::string error;
    if (!observe_movement(*movement, curve, readings, &observation, &error)) {
      spdlog::warn("{}: the zoom's movement from {:g} to {:g} is left out: {}", jobs[i].recording,
                   movement->from.zoom, movement->to.zoom, error);
      told->push_back({movement->from.zoom, movement->to.zoom, {}, error});
      continue;
    }
    told->push_back({movement->from.zoom, movement->to.zoom, observation, {}});
    observation.from = calibration_of[i - 1];
    observation.to = calibration_of[i];
    observations.push_back(std::move(observation));
  }
  return observations;
}

}  // namespace

int calibrate_zooms(const CalibrateOptions& options, std::vector<CalibrationJob> jobs,
                    StopSignals* signals) {
  refuse_priors_of_one_zoom(options, jobs.size());
  require_readings(jobs);
  OutputDirectory directory(options.directory, jobs.front().recording);
  std::vector<Calibration> calibrations;
  std::vector<std::optional<std::size_t>> calibration_of(jobs.size());
  ZoomFitOptions fit_options;
  std::vector<ZoomReportDwell> dwells;
  const std::string now = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    CalibrationJob& job = jobs[i];
    const std::string name = fmt::format("{} at zoom {:g}", job.recording, *job.zoom);
    job.options.learns_scales = false;
    CalibrationResult result = calibrate_job(options.passes, &job, signals);
    for (const std::string& remark : job.remarks) spdlog::warn("{}: {}", name, remark);
    std::string page;
    if (!result.frames.empty()) {
      page = fmt::format("report-{}.html", i + 1);
      directory.add(fmt::format("report_{}", i + 1).c_str(), page.c_str(),
                    calibration_report({name, job.input, job.options, result, job.remarks,
                                        ALIDADE_VERSION, now, job.untracked}));
    }
    if (!result.ok()) {
      spdlog::warn("{}: left out: {}: {}", name, to_string(result.status), result.message);
      dwells.push_back(
          {*job.zoom, {}, page, fmt::format("{}: {}", to_string(result.status), result.message)});
      continue;
    }
    result.calibration.zoom = job.zoom;
    dwells.push_back({*job.zoom, result.calibration, page, {}});
    calibration_of[i] = calibrations.size();
    calibrations.push_back(result.calibration);
    if (calibrations.size() == 1) fit_options = zoom_fit_options(job.options);
  }
  ZoomFit fit;
  std::string error;
  if (!fit_zoom(calibrations, fit_options, &fit, &error)) {
    throw CommandError(kExitFailed, fmt::format("{} of {} stretches of constant zoom could be "
                                                "calibrated: {}",
                                                calibrations.size(), jobs.size(), error));
  }
  for (CalibrationJob& job : jobs) track_movement(&job, signals);
  std::vector<ZoomReportMovement> told;
  const std::vector<MovementObservation> movements =
      observe_movements(jobs, calibration_of, calibrations, fit.curve, &told);
  if (!movements.empty()) {
    ZoomFit with_movements;
    if (fit_zoom(calibrations, movements, fit_options, &with_movements, &error)) {
      fit = with_movements;
    } else {
      spdlog::warn("movements of the zoom are left out: {}", error);
      for (ZoomReportMovement& each : told) each.refusal = error;
    }
  }
  for (const std::string& line : zoom_advice(fit.curve)) spdlog::warn("{}", line);
  const std::vector<Calibration> nodes = nodes_of(fit.curve);
  // Take sigmas from the curve: whoever uses the file has moved the zoom since, and curve.at()
  // includes that.
  Calibration first;
  if (!fit.curve.at(fit.curve.first_reading(), &first)) {
    throw CommandError(kExitFailed, "the zoom curve has no calibration at its first reading");
  }
  directory.add("report", "report.html",
                zoom_report({jobs.front().recording, fit, std::move(dwells), std::move(told),
                             ALIDADE_VERSION, now}));
  directory.add("calibration", "calibration.yaml", [&](const std::string& path, std::string* why) {
    CalibrationNotes notes;
    notes.zoom_curve = fit.curve;
    notes.pupil = jobs.front().options.pupil;
    return save_calibration(path, first, notes, why);
  });
  std::fputs(options.json ? zooms_json(fit, nodes, movements.size(), directory).c_str()
                          : zooms_text(fit, nodes, movements.size()).c_str(),
             stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
  for (const auto& [kind, path] : directory.files()) spdlog::info("{}: {}", kind, path);
  return kExitOk;
}

}  // namespace alidade

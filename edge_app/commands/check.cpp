// `alidade check`: is everything there that `run` needs, and does it do what `run` assumes? Reads
// the configuration and the calibration, measures video and pan/tilt at the same time for some
// seconds (check_measurement.h), and looks for the last picture in the scene map (check_scene.h).
// The folder check/ judges the samples; this file calls it and prints. Report and advice go to
// stdout, problems to stderr.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <unordered_map>
#include <vector>

#include "core/calibration/number_text.h"
#include "edge_app/check/motion_check.h"
#include "edge_app/check/repeat_check.h"
#include "edge_app/check/telemetry_check.h"
#include "edge_app/check/video_check.h"
#include "edge_app/commands/check.h"
#include "edge_app/commands/check_json.h"
#include "edge_app/commands/check_measurement.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/lens_prior.h"
#include "edge_app/commands/live_calibration.h"
#include "edge_app/commands/live_targets.h"
#include "edge_app/commands/log.h"
#include "edge_app/commands/scene_loading.h"
#include "edge_app/output/mqtt_connection.h"
#include "edge_app/self_calibration/steady_samples.h"
#include "platform/system/escaped.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

// How to reverse the sign of an axis, for this kind of device.
std::string reverse_advice(const PanTiltConfig& pan_tilt, bool is_pan) {
  const std::string axis = is_pan ? "pan" : "tilt";
  if (pan_tilt.type == PanTiltConfig::Type::kRecording) {
    return fmt::format("invert the sign of {}_rad in telemetry.csv", axis);
  }
  const bool positive = (is_pan ? pan_tilt.axes.pan : pan_tilt.axes.tilt).sign > 0;
  const char* other = is_pan ? (positive ? "left" : "right") : (positive ? "down" : "up");
  return fmt::format(
      "set pan_tilt.{}_positive: {}, or switch off what mirrors the picture in the camera's "
      "settings",
      axis, other);
}

// How the scale of the angles is set, for this kind of device.
std::string scale_advice(const PanTiltConfig& pan_tilt) {
  switch (pan_tilt.type) {
    case PanTiltConfig::Type::kOnvif:
      return "correct pan_tilt.pan_range_deg and tilt_range_deg: the angles at the ends of what "
             "the device can say, -1 and 1; often they are -180, 180 and -90, 90, whatever the "
             "head reaches";
    case PanTiltConfig::Type::kRecording:
      return "correct pan_rad and tilt_rad in telemetry.csv";
    default:
      return "correct the unit or the range of the angles in the device";
  }
}

// px; of a zoom that no calibration knows, its wide end's.
double least_focal_length(const PublishedCalibration& calibration, const Config& config) {
  return !calibration.calibrated && config.camera.focal_length_range
             ? config.camera.focal_length_range->wide_px
             : calibration.calibration.camera.focal_length;
}

MotionReport motion_of(const Measured& measured, const VideoReport& video,
                       const TelemetryReport& telemetry, const Config& config,
                       const PublishedCalibration& calibration) {
  std::unordered_map<std::int64_t, double> time_of;
  for (std::size_t i = 0; i < measured.frames.size(); ++i) {
    time_of[measured.frames[i].stamp.frame] = video.time_s[i];
  }
  std::vector<TimedShift> shifts;
  for (const ImageShift& shift : measured.images.shifts) {
    shifts.push_back({time_of[shift.from], time_of[shift.to], shift.shift});
  }
  MotionNeeds needs;
  needs.source = measured.pan_tilt.name;
  needs.video = measured.video.name;
  needs.image_width_px = video.width;
  needs.focal_length_px = least_focal_length(calibration, config);
  if (!calibration.calibrated && config.camera.focal_length_range)
    needs.tele_px = config.camera.focal_length_range->tele_px;
  needs.focal_length_from = calibration.calibrated ? calibration.name : "camera.focal_length_px";
  needs.calibrated = calibration.calibrated;
  needs.clock_offset_s = calibration.calibrated ? calibration.calibration.clock_offset : 0;
  needs.reverse_pan = reverse_advice(config.pan_tilt, true);
  needs.reverse_tilt = reverse_advice(config.pan_tilt, false);
  needs.turn_image =
      "if the camera hangs upside down, turn its picture by 180 degrees in its settings and set "
      "camera.upside_down: true; if not, for pan " +
      needs.reverse_pan + ", for tilt " + needs.reverse_tilt;
  needs.scales = scale_advice(config.pan_tilt);
  needs.not_judged = why_no_times(video.clock);
  if (needs.not_judged.empty() && telemetry.other_zoom) needs.not_judged = "the zoom moved";
  return check_measured_motion(shifts, telemetry.fresh, needs);
}

std::string zooms_of(const PublishedCalibration& calibration) {
  const ZoomCurve& curve = calibration.zoom_curve;
  if (!calibration.calibration.zoom) return "";
  if (curve.empty()) return fmt::format("{}", *calibration.calibration.zoom);
  // ZoomCurve::at() extrapolates that far beyond its nodes.
  const double range = curve.last_reading() - curve.first_reading();
  return fmt::format("readings {:g} to {:g}, by the zoom curve of {}",
                     curve.first_reading() - range, curve.last_reading() + range, calibration.name);
}

// The calibration that `run` would use at the last reported zoom. The one that it starts with if it
// has none for that zoom.
struct CalibrationHere {
  PublishedCalibration calibration;
  std::string lens;  // in words; empty: no zoom is reported, or there is no calibration for it
};

CalibrationHere calibration_here(const Measured& measured, const Config& config,
                                 const StartingCalibration& start) {
  std::vector<PanTiltSample> samples = measured.samples;
  const ZoomJitter jitter = steady_zoom(config.calibration.zoom_tolerance, &samples);
  const auto told = std::find_if(samples.rbegin(), samples.rend(), [](const PanTiltSample& sample) {
    return sample.zoom && std::isfinite(*sample.zoom);
  });
  if (told == samples.rend()) return {start.calibration, ""};
  const auto found = calibration_at(start, *told->zoom, jitter.tolerance);
  if (!found) return {start.calibration, ""};
  if (!found->calibrated) return {*found, ""};
  const Calibration& c = found->calibration;
  std::string lens = fmt::format(
      "f is {:.1f} +- {:.2g} px there ({})", c.camera.focal_length,
      std::sqrt(c.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength))),
      found->name);
  if (!found->zoom_curve.empty()) {
    lens = (is_between_zooms(found->zoom_curve, c.zoom.value_or(*told->zoom))
                ? "within the zoom curve; "
                : "beyond the zooms of the curve; ") +
           lens;
  }
  return {*found, lens};
}

TelemetryNeeds telemetry_needs(const Measured& measured, const Config& config,
                               const PublishedCalibration& calibration,
                               const OrientationStepOptions& step) {
  TelemetryNeeds needs;
  needs.source = measured.pan_tilt.name;
  if (!is_recording(config)) needs.rate_hz = config.pan_tilt.rate_hz;
  needs.limits = step.telemetry_limits;
  needs.angle_sigma_rad = step.telemetry_noise.pan_tilt_sigma;
  needs.resolution_rad = step.telemetry_noise.resolution;
  needs.focal_length_px = calibration.calibration.camera.focal_length;
  needs.clock_offset_s = calibration.calibrated ? calibration.calibration.clock_offset : 0;
  needs.zoom = calibration.calibration.zoom;
  needs.has_zoom_curve = !calibration.zoom_curve.empty();
  needs.zooms = zooms_of(calibration);
  needs.zoom_tolerance = config.calibration.zoom_tolerance;
  needs.makes_calibrations = config.calibration.automatic;
  needs.landmarks = config.realtime.landmarks;
  return needs;
}

std::string rate_of(const std::optional<double>& rate_hz) {
  return rate_hz ? fmt::format("{:.2f} Hz", *rate_hz) : "one only: no rate";
}

const char* sequence_clock(const VideoReport& video) {
  switch (video.stamped_at) {
    case StampedAt::kExposureStart:
      return "sequence numbers, stamped at the start of exposure";
    case StampedAt::kFrameEnd:
      return "sequence numbers, stamped at the end of the frame";
    case StampedAt::kArrival:
      break;
  }
  return "sequence numbers";
}

std::string headline(const VideoReport& video, const VideoNeeds& needs) {
  if (video.frames == 0) return "failed";
  const char* size = needs.width == 0  ? "no size to compare with"
                     : video.size_fits ? "as expected"
                                       : "not as expected";
  const char* clock = video.clock.kind == StampKind::kSender     ? "sender clock"
                      : video.clock.kind == StampKind::kSequence ? sequence_clock(video)
                                                                 : "arrival times only";
  return fmt::format("{}x{} px ({}), {}, {}", video.width, video.height, size,
                     rate_of(video.rate_hz), clock);
}

std::string headline(const TelemetryReport& telemetry) {
  constexpr double kDegrees = 180 / kPi;
  if (telemetry.samples == 0) return "failed";
  return fmt::format("pan {} deg, tilt {} deg, {}", rounded_text(kDegrees * telemetry.pan.last, 4),
                     rounded_text(kDegrees * telemetry.tilt.last, 4), rate_of(telemetry.rate_hz));
}

void print(const ReportLines& lines) {
  for (const auto& [label, text] : lines) fmt::print("  {:<13}{}\n", label, escaped(text));
}

void add_connection(const Connection& connection, const char* what, Findings* findings) {
  if (!connection.error.empty()) add_problem(findings, connection.error);
  if (!connection.waited.empty()) add_advice(findings, connection.waited);
  for (const std::string& note : connection.notes) add_advice(findings, note);
  if (connection.losses == 0) return;
  add_problem(findings,
              fmt::format("{} {}: the connection was lost {} during the check, last: {}", what,
                          connection.name, counted(connection.losses, "time"), connection.loss));
}

// Prints the report and the advice on stdout.
void print_report(const CheckReport& report, const VideoNeeds& video_needs) {
  const Measured& measured = report.measured;
  fmt::print("video          {}: {}\n", escaped(measured.video.name),
             headline(report.video, video_needs));
  print(describe(report.video));
  print(describe(measured.images));
  print(describe(report.repeats));
  fmt::print("pan/tilt       {}: {}\n", escaped(measured.pan_tilt.name),
             report.has_telemetry ? headline(report.telemetry) : "no telemetry, by configuration");
  print(describe(report.telemetry));
  if (report.motion) {
    fmt::print("together\n");
    print(describe(*report.motion));
  }
  if (!report.scene.file.empty()) {
    fmt::print("scene map      {}: {}\n", escaped(report.scene.file), headline(report.scene));
    print(describe(report.scene));
  }
  if (!report.broker.empty())
    fmt::print("mqtt           {}: {}\n", escaped(report.broker),
               report.broker_error.empty() ? "connected" : "failed");
  for (const Finding& finding : report.findings) {
    if (finding.severity == Severity::kAdvice)
      fmt::print("advice         {}\n", escaped(finding.text));
  }
}

// Prints what is known before the measurement.
void print_beginning(const std::string& configuration, const PublishedCalibration& calibration) {
  const Camera<double>& camera = calibration.calibration.camera;
  fmt::print("configuration  {}: ok\n", escaped(configuration));
  fmt::print("calibration    {}: {}focal length {:.1f} px, clock offset {} ms\n",
             escaped(calibration.name),
             calibration.calibrated ? fmt::format("{}x{} px, ", camera.width, camera.height)
                                    : "not calibrated, ",
             camera.focal_length, rounded_text(1e3 * calibration.calibration.clock_offset, 1));
  std::fflush(stdout);
}

// Runs before the measurement, so that a faulty lens prior ends the command at once.
void check_lens_prior(const Config& config, const Camera<double>& camera) {
  if (config.calibration.prior.empty() || camera.width == 0) return;
  std::vector<std::string> remarks;
  const KnownCamera known =
      load_lens_prior(config.calibration.prior, camera.width, camera.height, &remarks);
  for (const std::string& remark : remarks) spdlog::warn("{}", remark);
  spdlog::info(
      "{}: line delay {}", config.calibration.prior,
      estimate_text(1e6 * known.line_delay.prior.value, 1e6 * known.line_delay.prior.sigma, "us"));
}

// Empty: files can be made in this folder, or in the nearest one above it that exists.
std::string folder_error(std::filesystem::path folder) {
  std::error_code error;
  // The folder of a bare file name is empty.
  const std::filesystem::path wanted =
      std::filesystem::absolute(folder.empty() ? "." : folder, error).lexically_normal();
  folder = wanted;
  while (!std::filesystem::exists(folder, error) && folder.has_relative_path())
    folder = folder.parent_path();
  const bool is_folder = std::filesystem::is_directory(folder, error);
  if (is_folder && ::access(folder.c_str(), W_OK | X_OK) == 0) return "";
  return fmt::format("{}: no file can be made there: {}{}; name a folder that can be written",
                     wanted.string(), folder == wanted ? "" : folder.string() + ": ",
                     std::generic_category().message(is_folder ? errno : ENOTDIR));
}

// What `run` would write later, and lose if it cannot.
void check_folders(const Config& config, const std::string& file, Findings* findings) {
  const auto judge = [&](const char* key, const std::filesystem::path& folder) {
    const std::string error = folder_error(folder);
    if (!error.empty()) add_problem(findings, fmt::format("{}: {}: {}", file, key, error));
  };
  if (!config.output.recordings.empty()) judge("output.recordings", config.output.recordings);
  if (config.realtime.landmarks && config.calibration.automatic && !config.calibration.file.empty())
    judge("calibration.file", std::filesystem::path(config.calibration.file).parent_path());
  if (config.scene_map.update)
    judge("scene_map.file", std::filesystem::path(config.scene_map.file).parent_path());
}

// Empty: the broker accepts a connection.
std::string broker_error(const MqttOptions& options) {
  const std::string error = MqttConnection::files_error(options);
  return error.empty() ? MqttConnection::try_once(options) : error;
}

}  // namespace

int check_links(const CheckOptions& options) {
  const Config config = require_config(options.config);
  const StartingCalibration start =
      load_starting_calibration(config, options.config, CalibrationStore::Use::kLook);
  // Where `run` calibrates, load_starting_calibration() has loaded the prior already.
  if (!start.calibrating.calibration)
    check_lens_prior(config, start.calibration.calibration.camera);
  static_cast<void>(require_plane(config));
  static_cast<void>(load_network(config.detectors.onnx));
  if (!options.json) print_beginning(options.config, start.calibration);

  const Measured measured = measure(config, options.duration_s);
  const auto [calibration, lens] = calibration_here(measured, config, start);
  const OrientationStepOptions step = step_options(config, calibration);
  const Camera<double>& camera = calibration.calibration.camera;
  const VideoNeeds video_needs{
      measured.video.name, calibration.name,          camera.width,
      camera.height,       config.realtime.landmarks, calibration.calibrated};
  const VideoReport video = check_video(measured.frames, measured.counters,
                                        measured.counters_at_start, step.video_clock, video_needs);
  TelemetryNeeds of_telemetry = telemetry_needs(measured, config, calibration, step);
  of_telemetry.lens_at_zoom = lens;
  const TelemetryReport telemetry =
      check_telemetry(measured.samples, measured.delivered_s, step.telemetry_clock, of_telemetry);

  CheckReport report{
      options.config, calibration, measured, video, telemetry, {}, {}, {}, {}, {}, {}, {}};
  report.has_telemetry = has_telemetry(config);
  report.repeats = check_repeats(measured.frames, video.time_s, telemetry.fresh,
                                 {measured.video.name, least_focal_length(calibration, config)});
  add_connection(measured.video, "video", &report.findings);
  if (report.has_telemetry) add_connection(measured.pan_tilt, "pan/tilt", &report.findings);
  const auto add = [&report](const Findings& more) {
    report.findings.insert(report.findings.end(), more.begin(), more.end());
  };
  if (start.calibrating.calibration && camera.width == 0 && video.width > 0) {
    add_problem(&report.findings,
                fmt::format("{}: video.width and video.height are missing: without a calibration, "
                            "OE mode needs the size of the picture; set width: {} and height: {}, "
                            "or realtime.mode: PT",
                            options.config, video.width, video.height));
  }
  add(video.findings);
  add(measured.images.findings);
  add(report.repeats.findings);
  if (report.has_telemetry) add(telemetry.findings);
  if (measured.images.images > 1 && !telemetry.fresh.empty()) {
    report.motion = motion_of(measured, video, telemetry, config, calibration);
    add(report.motion->findings);
  }
  report.scene = check_scene(config, calibration, measured);
  add(report.scene.findings);
  if (!is_recording(config)) check_folders(config, options.config, &report.findings);
  if (config.mqtt) {
    report.broker = config.mqtt->name();
    report.broker_error = broker_error(*config.mqtt);
    if (!report.broker_error.empty()) add_problem(&report.findings, report.broker_error);
  }
  if (options.json) {
    std::fputs(check_json(report).c_str(), stdout);
  } else {
    print_report(report, video_needs);
  }
  for (const Finding& finding : report.findings) {
    if (finding.severity == Severity::kProblem) print_error(finding.text);
  }
  return is_ok(report.findings) ? kExitOk : kExitFailed;
}

}  // namespace alidade

#include "edge_app/commands/command.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/plane_file.h"
#include "platform/pan_tilt/onvif_source.h"
#include "platform/pan_tilt/query_source.h"
#include "platform/pan_tilt/recording_pan_tilt_source.h"
#include "platform/pan_tilt/vapix_source.h"
#include "platform/storage/recording.h"
#include "platform/system/text.h"
#include "platform/video/mjpeg_source.h"
#include "platform/video/recording_frame_source.h"
#include "platform/video/rtp_source.h"
#include "platform/video/v4l2_source.h"

namespace alidade {

Config require_config(const std::string& path) {
  Config config;
  std::string error;
  if (!load_config(path, &config, &error)) throw CommandError(kExitUsage, error);
  for (const std::string& warning : config.warnings) spdlog::warn("{}", warning);
  if (is_recording(config)) {
    // Errors are ignored here. The recording's source reports them, or whoever needs the size.
    RecordingInfo info;
    if (read_recording_info(config.video.directory, &info, &error)) {
      config.video.width = info.width;
      config.video.height = info.height;
    }
  }
  return config;
}

VideoConfig require_video_config(const std::string& path) {
  Config config;
  std::string error;
  if (!load_config(path, &config, &error, ConfigScope::kVideo))
    throw CommandError(kExitUsage, error);
  return config.video;
}

PublishedCalibration require_calibration_file(const std::string& path) {
  PublishedCalibration chosen;
  std::string error;
  if (!load_calibration(path, &chosen.calibration, &error, &chosen.zoom_curve,
                        &chosen.telemetry_error))
    throw CommandError(kExitUsage, error);
  chosen.calibrated = true;
  chosen.name = path;
  return chosen;
}

std::shared_ptr<const PlaneEstimate> require_plane(const Config& config) {
  if (config.tracking.plane.empty()) return nullptr;
  PlaneEstimate plane;
  std::string error;
  if (!load_plane(config.tracking.plane, &plane, &error)) throw CommandError(kExitUsage, error);
  return std::make_shared<const PlaneEstimate>(plane);
}

PublishedCalibration choose_calibration(const Config& config) {
  const std::string& file = config.calibration.file;
  const bool not_yet = config.calibration.automatic && config.camera.focal_length_px &&
                       !std::filesystem::exists(file);
  const VideoConfig& video = config.video;
  if (!file.empty() && !not_yet) {
    PublishedCalibration chosen = require_calibration_file(file);
    const Camera<double>& camera = chosen.calibration.camera;
    // The frames of a recording have their own size.
    if (!is_recording(config) && video.width > 0 &&
        (video.width != camera.width || video.height != camera.height)) {
      throw CommandError(
          kExitUsage,
          fmt::format(
              "{}: is for {}x{} px, but the configuration's video is {}x{} px; set "
              "video.width and video.height to the calibration's, or calibrate at this size",
              file, camera.width, camera.height, video.width, video.height));
    }
    return chosen;
  }
  if (not_yet) {
    spdlog::warn("{}: no calibration yet; the data sheet's camera is used",
                 file.empty() ? "calibration.file is not set" : file);
  }
  PublishedCalibration chosen;
  chosen.calibration = data_sheet_calibration(config.camera);
  chosen.name = "data sheet";
  chosen.calibration.camera.width = video.width;
  chosen.calibration.camera.height = video.height;
  return chosen;
}

Calibration data_sheet_calibration(const CameraConfig& camera) {
  Calibration calibration;
  calibration.camera.focal_length = *camera.focal_length_px;
  if (camera.focal_length_range) {
    // log f is uniform between the ends of the range.
    const double sigma =
        std::log(camera.focal_length_range->tele_px / camera.focal_length_range->wide_px) /
        std::sqrt(12.0) * *camera.focal_length_px;
    calibration.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) =
        sigma * sigma;
  }
  calibration.camera.aspect = camera.aspect;
  calibration.camera.distortion.only_term() = camera.radial_distortion;
  calibration.line_delay = camera.upside_down ? -camera.line_delay_s : camera.line_delay_s;
  // What is not measured is nominal. These sigmas allow for axes mounted as well as PTCEE assumes,
  // and for the difference in delay between two network links.
  constexpr double kAxisSigma_rad = 0.05;
  constexpr double kClockOffsetSigma_s = 0.1;
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    calibration.covariance(index(axis), index(axis)) = kAxisSigma_rad * kAxisSigma_rad;
  }
  calibration.covariance(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) =
      kClockOffsetSigma_s * kClockOffsetSigma_s;
  return calibration;
}

namespace {

// Readings that change by steps cannot show what repeats within one of them.
void require_coarser_than_steps(const char* name, const AngleErrorCurve& curve, double step_rad,
                                const std::string& file) {
  if (curve.count < 2) return;
  const double shortest_rad = std::max(2 * curve.spacing_rad, 2 * kPi * curve.length_rad);
  if (shortest_rad >= step_rad) return;
  throw CommandError(
      kExitUsage,
      fmt::format("{}: {} has a period of {:.3g} rad, shorter than the steps of "
                  "pan_tilt.angle_quantum_rad ({:.3g} rad), which cannot show it; remove {}, or "
                  "state the head's true steps",
                  file, name, shortest_rad, step_rad, name));
}

}  // namespace

OrientationStepOptions step_options(const Config& config, const PublishedCalibration& calibration) {
  const double step_rad = config.pan_tilt.angle_quantum_rad;
  require_coarser_than_steps("pan_error", calibration.telemetry_error.pan, step_rad,
                             calibration.name);
  require_coarser_than_steps("tilt_error", calibration.telemetry_error.tilt, step_rad,
                             calibration.name);
  OrientationStepOptions options = step_options(RecordingNoise{}, calibration);
  options.wait_for_pace = options.other_connection =
      config.video.type != VideoConfig::Type::kRecording;
  options.unseen_delay_sigma_s =
      config.calibration.clock_offset_sigma_s.value_or(options.unseen_delay_sigma_s);
  TelemetryNoise& noise = options.telemetry_noise;
  noise.pan_tilt_sigma = config.pan_tilt.angle_sigma_rad.value_or(noise.pan_tilt_sigma);
  noise.resolution = config.pan_tilt.angle_quantum_rad;
  noise.acceleration_sigma = config.pan_tilt.acceleration_sigma_rad_s2;
  if (config.camera.focal_length_range) {
    const Camera<double>& camera = calibration.calibration.camera;
    options.any_zoom = data_sheet_calibration(config.camera);
    options.any_zoom->camera.width = camera.width;
    options.any_zoom->camera.height = camera.height;
  }
  options.telemetry_limits.max_repeat_s = config.pan_tilt.max_repeat_s;
  options.telemetry_limits.max_extrapolation_s = config.realtime.max_extrapolation_s;
  return options;
}

OrientationStepOptions step_options(const RecordingNoise& noise,
                                    const PublishedCalibration& calibration) {
  const auto clock = [](std::optional<double> stamp_sigma_s, std::optional<double> period_s,
                        std::optional<double> period_sigma_s) {
    ClockFilterOptions options;
    options.jitter = stamp_sigma_s ? ClockJitter::kSymmetric : ClockJitter::kOneSided;
    options.expected_jitter_s = stamp_sigma_s.value_or(options.expected_jitter_s);
    options.nominal_period_s = period_s.value_or(options.nominal_period_s);
    options.nominal_period_sigma_s = period_sigma_s.value_or(options.nominal_period_sigma_s);
    return options;
  };
  OrientationStepOptions options;
  options.calibration = calibration.calibration;
  options.calibrated = calibration.calibrated;
  options.zoom_curve = calibration.zoom_curve;
  options.telemetry_error = calibration.telemetry_error;
  options.video_clock =
      clock(noise.image_stamp_sigma_s, noise.image_period_s, noise.image_period_sigma_s);
  // RTP's clock, the coarsest of all live video streams.
  options.video_clock.stamp_resolution_s = 1.0 / 90000;
  options.telemetry_clock = clock(noise.telemetry_stamp_sigma_s, noise.telemetry_period_s,
                                  noise.telemetry_period_sigma_s);
  options.video_stamp_sigma_s = noise.image_stamp_sigma_s.value_or(options.video_stamp_sigma_s);
  options.telemetry_stamp_sigma_s =
      noise.telemetry_stamp_sigma_s.value_or(options.telemetry_stamp_sigma_s);
  options.telemetry_noise.pan_tilt_sigma =
      noise.pan_tilt_sigma_rad.value_or(options.telemetry_noise.pan_tilt_sigma);
  options.telemetry_noise.resolution =
      noise.pan_tilt_quantum_rad.value_or(options.telemetry_noise.resolution);
  options.telemetry_noise.period_sigma_s =
      noise.telemetry_period_sigma_s.value_or(options.telemetry_noise.period_sigma_s);
  return options;
}

namespace {

// A larger picture is reported and not decoded, so that a camera cannot make the program take more
// memory than the configured size needs.
std::int64_t most_pixels(const VideoConfig& config) {
  return config.width > 0 ? std::int64_t{config.width} * config.height : kMostLivePixels;
}

// The options that all live sources share.
template <class Options>
Options live_options(const VideoConfig& config, bool decode) {
  Options options;
  options.decode = decode;
  options.timeout_s = config.timeout_s;
  options.max_backoff_s = config.max_backoff_s;
  return options;
}

// Those that sources behind a URL share.
template <class Options>
Options streamed_options(const VideoConfig& config, bool decode) {
  auto options = live_options<Options>(config, decode);
  options.url = config.url;
  options.user = config.user;
  options.password = config.password;
  options.rules = config.rules;
  options.max_pixels = most_pixels(config);
  return options;
}

RtpSourceOptions rtp_options(const VideoConfig& config, bool decode) {
  auto options = streamed_options<RtpSourceOptions>(config, decode);
  options.format = config.format;
  options.transport = config.transport == VideoConfig::Transport::kUdp
                          ? RtpSourceOptions::Transport::kUdp
                          : RtpSourceOptions::Transport::kTcp;
  options.certificate_file = config.certificate_file;
  return options;
}

V4l2SourceOptions v4l2_options(const VideoConfig& config, bool decode) {
  auto options = live_options<V4l2SourceOptions>(config, decode);
  options.device = config.device;
  options.wish = {config.pixel_format, config.width, config.height, config.rate_hz};
  return options;
}

}  // namespace

std::unique_ptr<FrameSource> make_frame_source(const VideoConfig& config, bool decode) {
  switch (config.type) {
    case VideoConfig::Type::kRtsp:
    case VideoConfig::Type::kRtp:
      return open_rtp(rtp_options(config, decode));
    case VideoConfig::Type::kMjpeg:
      return open_mjpeg(streamed_options<MjpegSourceOptions>(config, decode));
    case VideoConfig::Type::kV4l2:
      return open_v4l2(v4l2_options(config, decode));
    case VideoConfig::Type::kRecording:
      return open_recorded_frames(RecordingFrameSourceOptions{config.directory, decode, true});
    case VideoConfig::Type::kCount:
      break;
  }
  throw std::logic_error("a type of video source that does not exist");
}

namespace {

// The options that all polled sources share.
template <class Options>
Options polling_options(const PanTiltConfig& config) {
  Options options;
  options.pan = config.axes.pan;
  options.tilt = config.axes.tilt;
  options.rate_hz = config.rate_hz;
  options.timeout_s = config.timeout_s;
  options.max_backoff_s = config.max_backoff_s;
  return options;
}

template <class Options>
Options http_options(const PanTiltConfig& config) {
  auto options = polling_options<Options>(config);
  options.url = config.url;
  options.user = config.user;
  options.password = config.password;
  options.rules = config.rules;
  return options;
}

std::unique_ptr<PanTiltSource> make_vapix_source(const PanTiltConfig& config) {
  auto options = http_options<VapixSourceOptions>(config);
  options.camera = config.camera;
  return open_vapix(options);
}

std::unique_ptr<PanTiltSource> make_onvif_source(const PanTiltConfig& config) {
  const auto radians = [](const std::optional<std::array<double, 2>>& deg) {
    constexpr double kRadians = 3.14159265358979323846 / 180;
    return deg ? std::optional<OnvifRange>({kRadians * deg->front(), kRadians * deg->back()})
               : std::nullopt;
  };
  auto options = http_options<OnvifSourceOptions>(config);
  options.profile = config.profile;
  options.pan_range = radians(config.pan_range_deg);
  options.tilt_range = radians(config.tilt_range_deg);
  const auto scale = [](const std::optional<std::array<double, 2>>& ends) {
    return ends ? std::optional<OnvifInterval>({ends->front(), ends->back()}) : std::nullopt;
  };
  options.pan_scale = scale(config.pan_scale);
  options.tilt_scale = scale(config.tilt_scale);
  options.ptz_path = config.ptz_path;
  return open_onvif(options);
}

std::unique_ptr<PanTiltSource> make_head_source(const PanTiltConfig& config) {
  auto options = polling_options<QuerySourceOptions>(config);
  options.link = config.head.link;
  return std::make_unique<QuerySource>(make_protocol(config.head.protocol), options);
}

// Stands for a missing source: the stream ends at once.
class NoPanTilt : public PanTiltSource {
 public:
  ReadStatus read(PanTiltSample&, double) override { return ReadStatus::kEnd; }
  void stop() override {}
  [[nodiscard]] std::string error() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "none"; }
};

}  // namespace

std::unique_ptr<PanTiltSource> make_pan_tilt_source(const PanTiltConfig& config) {
  switch (config.type) {
    case PanTiltConfig::Type::kVapix:
      return make_vapix_source(config);
    case PanTiltConfig::Type::kOnvif:
      return make_onvif_source(config);
    case PanTiltConfig::Type::kHead:
      return make_head_source(config);
    case PanTiltConfig::Type::kNone:
      return std::make_unique<NoPanTilt>();
    case PanTiltConfig::Type::kRecording:
      break;
  }
  return open_recorded_pan_tilt({config.directory, true});
}

std::string nothing_came(const std::string& source, double wait_s) {
  return fmt::format("{}: connected, but nothing came within {:.0f} s", source, wait_s);
}

void log_source_losses(const FrameSource& source) {
  const FrameSourceCounters counters = source.counters();
  if (counters.damaged > 0 || counters.dropped > 0) {
    spdlog::warn("{}: {} damaged, {} dropped before they were read", source.name(),
                 counted(counters.damaged, "frame"), counters.dropped);
  }
  if (counters.unstamped > 0 || counters.foreign_packets > 0 || counters.garbage_bytes > 0) {
    spdlog::warn(
        "{}: {} had an impossible time stamp; {} of another session and {} outside any packet were "
        "left out",
        source.name(), counted(counters.unstamped, "frame"),
        counted(counters.foreign_packets, "packet"), counted(counters.garbage_bytes, "byte"));
  }
}

bool is_recording(const Config& config) {
  return config.video.type == VideoConfig::Type::kRecording;
}

bool is_terminal(int descriptor) { return ::isatty(descriptor) == 1; }

}  // namespace alidade

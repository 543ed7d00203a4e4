// `alidade check`: is everything that `run` needs there? Reads the configuration and the calibration,
// tries both connections at once, and measures what no data sheet says: rates, the width of the
// telemetry's time interval, stale repeats, the smallest step. A short report goes to stdout, what is
// wrong to stderr.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/commands/command.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

struct CheckOptions {
  std::string config;
  double duration_s = 3;
};

// What one connection gave.
template <typename Item>
struct Sampled {
  std::vector<Item> items;
  std::string error;  // empty: none
};

// Reads for duration_s from the first item on; the first may take wait_s. Ends at the first error: that
// is what the person wants to know.
template <typename Item, typename Source>
Sampled<Item> sample(Source& source, double wait_s, double duration_s) {
  constexpr double kReadTimeout = 0.2;  // s
  Sampled<Item> sampled;
  double end_s = monotonic_now_s() + wait_s;
  while (monotonic_now_s() < end_s) {
    Item item;
    const ReadStatus status = source.read(item, kReadTimeout);
    if (status == ReadStatus::kTimeout) continue;
    if (status == ReadStatus::kEnd || status == ReadStatus::kStopped) break;
    if (status != ReadStatus::kOk) {
      sampled.error = source.error();
      break;
    }
    if (sampled.items.empty()) end_s = monotonic_now_s() + duration_s;
    sampled.items.push_back(item);
  }
  if (sampled.items.empty() && sampled.error.empty()) {
    sampled.error =
        fmt::format("{}: connected, but nothing came within {:.0f} s", source.name(), wait_s);
  }
  return sampled;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string rate(std::size_t count, double first_s, double last_s) {
  if (count < 2 || last_s <= first_s) return "one only: no rate";
  return fmt::format("{:.2f} Hz", static_cast<double>(count - 1) / (last_s - first_s));
}

// One line on video; adds to `errors` what is wrong.
std::string report_video(const Sampled<Frame>& video, const NamedCalibration& calibration,
                         std::vector<std::string>* errors) {
  if (!video.error.empty()) errors->push_back(video.error);
  if (video.items.empty()) return "failed";
  const Frame& first = video.items.front();
  const Frame& last = video.items.back();
  const char* clock = last.stamp.sender_time_s ? "sender clock"
                      : last.stamp.sequence    ? "sequence numbers"
                                               : "arrival times only";
  const Camera<double>& camera = calibration.calibration.camera;
  std::string size = "no size to compare with";
  if (camera.width > 0) {
    const bool match = first.width == camera.width && first.height == camera.height;
    size = match ? "as expected" : "not as expected";
    if (!match) {
      errors->push_back(
          fmt::format("video: frames of {}x{} px, but {} is for {}x{} px; set the camera to the "
                      "calibration's size or calibrate at this one",
                      first.width, first.height, calibration.name, camera.width, camera.height));
    }
  }
  return fmt::format(
      "{}x{} px ({}), {}, {}", first.width, first.height, size,
      rate(video.items.size(), first.stamp.receive_time_s, last.stamp.receive_time_s), clock);
}

std::string report_pan_tilt(const Sampled<PanTiltSample>& telemetry,
                            std::vector<std::string>* errors) {
  constexpr double kDegrees = 180 / 3.14159265358979323846;
  if (!telemetry.error.empty()) errors->push_back(telemetry.error);
  if (telemetry.items.empty()) return "failed";
  const std::vector<PanTiltSample>& samples = telemetry.items;
  std::vector<double> widths;
  std::size_t repeats = 0;
  double step_rad = 0;  // smallest change of an angle between two samples
  for (std::size_t i = 0; i < samples.size(); ++i) {
    widths.push_back(samples[i].latest_time_s - samples[i].earliest_time_s);
    if (i == 0) continue;
    const double pan_step = std::abs(samples[i].pan_rad - samples[i - 1].pan_rad);
    const double tilt_step = std::abs(samples[i].tilt_rad - samples[i - 1].tilt_rad);
    if (pan_step == 0 && tilt_step == 0) ++repeats;
    for (const double step : {pan_step, tilt_step}) {
      if (step > 0 && (step_rad == 0 || step < step_rad)) step_rad = step;
    }
  }
  return fmt::format(
      "pan {:.4f} deg, tilt {:.4f} deg, {}, time known to {:.1f} ms (median interval), {}",
      samples.back().pan_rad * kDegrees, samples.back().tilt_rad * kDegrees,
      rate(samples.size(), samples.front().latest_time_s, samples.back().latest_time_s),
      1e3 * median(widths),
      step_rad == 0
          ? "head at rest"
          : fmt::format("smallest step {:.5f} deg, {} of {} samples repeat the one before",
                        step_rad * kDegrees, repeats, samples.size()));
}

int check(const CheckOptions& options) {
  constexpr double kConnectSlack =
      2;  // s beyond a source's own timeout, for logging in and a first key frame
  const Config config = require_config(options.config);
  fmt::print("configuration  {}: ok\n", options.config);
  const NamedCalibration calibration = choose_calibration(config);
  const Camera<double>& camera = calibration.calibration.camera;
  fmt::print("calibration    {}: {}focal length {:.1f} px, clock offset {:.1f} ms\n",
             calibration.name,
             calibration.calibrated ? fmt::format("{}x{} px, ", camera.width, camera.height)
                                    : "not calibrated, ",
             camera.focal_length, 1e3 * calibration.calibration.clock_offset);

  const auto video_source = make_frame_source(config.video, false);
  const auto pan_tilt_source = make_pan_tilt_source(config.pan_tilt);
  Sampled<PanTiltSample> telemetry;
  std::thread telemetry_thread([&] {
    telemetry = sample<PanTiltSample>(*pan_tilt_source, config.pan_tilt.timeout_s + kConnectSlack,
                                      options.duration_s);
  });
  const Sampled<Frame> video =
      sample<Frame>(*video_source, config.video.timeout_s + kConnectSlack, options.duration_s);
  telemetry_thread.join();

  std::vector<std::string> errors;
  fmt::print("video          {}: {}\n", video_source->name(),
             report_video(video, calibration, &errors));
  fmt::print("pan/tilt       {}: {}\n", pan_tilt_source->name(),
             report_pan_tilt(telemetry, &errors));
  for (const std::string& error : errors) fmt::print(stderr, "alidade: {}\n", error);
  return errors.empty() ? kExitOk : kExitFailed;
}

}  // namespace

void register_check(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      app.add_subcommand("check", "Validate the configuration and try each connection");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("--duration", options->duration_s, "Seconds to measure each stream for")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([options, exit_code] { *exit_code = check(*options); });
}

}  // namespace alidade

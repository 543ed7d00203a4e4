#include "test/accuracy/zoom_day.h"
#include "test/accuracy/photos_of_all_scales.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>
#include <utility>

#include "core/model/trigonometry.h"
#include "test/simulator/random.h"
#include "test/simulator/telemetry.h"
#include "test/simulator/zoom_curve.h"

namespace alidade::test {
namespace {

constexpr double kColumns = 1280;  // that the lens is told for
constexpr double kWide_px = 1200;
constexpr double kTele_px = 24000;
constexpr double kSpeed = 0.75;      // 1/s, of the motor
constexpr double kAcceleration = 3;  // 1/s^2
constexpr double kSlowest = 0.15;    // 1/s, mean of a movement
constexpr double kAxis_rad = 13e-3;
constexpr double kSenderTick_s = 1.0 / 90000;
constexpr double kSenderSkew = 50e-6;
constexpr double kLatencyJitter_s = 1.5e-3;  // mean of the exponential
constexpr double kPollInterval_s = 1.0 / 30;
constexpr double kPollLeast_s = 3e-3;   // from request to answer
constexpr double kPollJitter_s = 2e-3;  // mean of the exponential
constexpr int kJpegQuality = 85;

simulator::Config camera_of(const ZoomDayPlan& plan) {
  simulator::Config config;
  config.seed = plan.seed;
  config.image = {plan.width, plan.width * 9 / 16, plan.rate_hz};
  // The read-out takes as long as that of 720 rows.
  config.camera.line_delay = -14.2e-6 * kColumns / plan.width;
  config.camera.pan_axis_offset = {-kAxis_rad, 0};
  config.camera.tilt_axis_offset = {0, kAxis_rad};
  config.scene.background = 0.6;
  config.scene.detail = 1;
  add_photos_of_all_scales(&config);
  config.sensor.exposure = 1e-3;
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 1.3;  // 2 with the shots
  config.telemetry.sigma = 5e-5;
  config.telemetry.quantum = 0.001 * kPi / 180;
  simulator::ZoomConfig& zoom = config.zoom.emplace();
  const double scale = plan.width / kColumns;
  zoom.focal_length = {kWide_px * scale, kTele_px * scale};
  zoom.distortion = {-0.04, 0.01};
  zoom.centre = {4 * scale, -3 * scale};
  zoom.centre_wander = 12 * scale;
  zoom.sigma_rep = 2e-3;
  zoom.backlash = 1e-3;
  zoom.speed = kSpeed;
  zoom.acceleration = kAcceleration;
  zoom.path.type = simulator::ZoomPathConfig::Type::kCsv;
  return config;
}

// s, the least: the path's cubic is fastest in its middle, by 1.5 times its mean, and its acceleration greatest at its ends.
double shortest_movement_s(double log_distance) {
  return std::max(1.5 * log_distance / kSpeed, std::sqrt(6 * log_distance / kAcceleration));
}

// By parts of the field of view that the lens has at that time: two sums of sines whose phases stop now and then.
class DayPath : public simulator::Path {
 public:
  DayPath(const simulator::Config& config, std::uint64_t seed) : zoom_(config) {
    std::mt19937_64 random = simulator::make_generator(seed, simulator::Stream::kZoom);
    std::uniform_real_distribution<double> turn(0, simulator::kTwoPi);
    for (double& phase : phases_) phase = turn(random);
    width_ = config.image.width;
    const auto steps = static_cast<std::size_t>(config.duration / kStep_s) + 3;
    pace_.resize(steps);
    for (std::size_t i = 1; i < steps; ++i) {
      const double t = (static_cast<double>(i) - 0.5) * kStep_s;
      const double pace = 0.8 + std::sin(simulator::kTwoPi * t / 61 + phases_[4]) +
                          0.5 * std::sin(simulator::kTwoPi * t / 23 + phases_[5]);
      pace_[i] = pace_[i - 1] + kStep_s * std::clamp(pace, 0.05, 1.2);
    }
  }

  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const double tau = pace_at(std::max(time_s, 0.0));
    const double field = width_ / std::exp(zoom_.path().at(time_s).log_focal_length);
    const auto wave = [&](double period_s, double phase) {
      return std::sin(simulator::kTwoPi * tau / period_s + phase);
    };
    return {field * (0.3 * wave(7.3, phases_[0]) + 0.15 * wave(2.9, phases_[1])),
            field * (0.12 * wave(5.1, phases_[2]) + 0.08 * wave(2.3, phases_[3]))};
  }
  [[nodiscard]] double period_s() const override { return 0; }

 private:
  static constexpr double kStep_s = 0.05;

  // Between the steps the parabola by which its rate is continuous.
  [[nodiscard]] double pace_at(double time_s) const {
    const double position =
        std::clamp(time_s / kStep_s, 1.0, static_cast<double>(pace_.size()) - 2.001);
    const auto i = static_cast<std::size_t>(position);
    const double x = time_s / kStep_s - static_cast<double>(i);
    const double before = pace_[i] - pace_[i - 1];
    const double after = pace_[i + 1] - pace_[i];
    return pace_[i] - before / 2 + before * x + (after - before) * x * x / 2;
  }

  simulator::Zoom zoom_;
  double width_ = 0;
  std::array<double, 6> phases_{};
  std::vector<double> pace_;
};

}  // namespace

ZoomDay::ZoomDay(const ZoomDayPlan& plan) : plan_(plan), config_(camera_of(plan)) {
  std::mt19937_64 random = simulator::make_generator(plan.seed, simulator::Stream::kZoom);
  std::uniform_real_distribution<double> unit(0, 1);
  const simulator::ZoomConfig& zoom = *config_.zoom;
  const simulator::ZoomCurve curve(zoom);
  const double log_wide = std::log(zoom.focal_length.wide);
  const double log_range = std::log(zoom.focal_length.tele) - log_wide;
  // Parts of the range of log f.
  const double first = 0.3 * unit(random);
  const double second = first + 0.4 + 0.3 * unit(random);
  std::vector<double> places = {first, second,
                                first + (second - first) * (0.2 + 0.6 * unit(random))};
  std::vector<double> rests_s = {plan.first_rest_s, plan.rest_s, plan.rest_s};
  for (int i = 0; i < plan.movements; ++i) places.push_back(unit(random));
  std::vector<double> moves_s;
  double moving_s = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double distance = std::abs(places[i] - places[i - 1]) * log_range;
    const double shortest_s = 1.01 * shortest_movement_s(distance);
    const double longest_s = std::max(shortest_s, distance / kSlowest);
    // Fast ones more often than slow ones.
    const double slowness = unit(random);
    moves_s.push_back(shortest_s + slowness * slowness * (longest_s - shortest_s));
    if (i > 2) moving_s += moves_s.back();
  }
  const double mean_rest_s =
      plan.movements > 0 ? std::max(0.0, plan.movements_s - moving_s) / plan.movements : 0;
  for (int i = 0; i < plan.movements; ++i) rests_s.push_back(0.2 + mean_rest_s * 2 * unit(random));
  std::string table = "time_s,zoom\n";
  double now_s = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double log_f = log_wide + places[i] * log_range;
    const double reading = curve.reading(curve.part_at(log_f));
    rests_.push_back({now_s, now_s + rests_s[i], std::exp(log_f)});
    table +=
        fmt::format("{:.6f},{:.9f}\n{:.6f},{:.9f}\n", now_s, reading, now_s + rests_s[i], reading);
    now_s += rests_s[i] + (i < moves_s.size() ? moves_s[i] : 0);
  }
  config_.duration = now_s;
  config_.zoom->path.file = directory_.write("zoom.csv", table);
  camera_ =
      std::make_unique<ZoomingCamera>(config_, std::make_unique<DayPath>(config_, plan.seed), 0);
  // All that the frames follow from.
  kept_.emplace("zoom_day",
                fmt::format("{} {} {} {} {} {} {}", plan.seed, plan.width, plan.rate_hz,
                            plan.first_rest_s, plan.rest_s, plan.movements, plan.movements_s),
                plan.cache);
  make_frames();
  make_samples();
  for (std::size_t i = 0; i < frames_.size(); ++i)
    events_.push_back({true, frames_[i].receive_time_s, i});
  for (std::size_t i = 0; i < samples_.size(); ++i)
    events_.push_back({false, samples_[i].latest_time_s, i});
  std::stable_sort(events_.begin(), events_.end(),
                   [](const Event& a, const Event& b) { return a.host_time_s < b.host_time_s; });
}

void ZoomDay::make_frames() {
  std::mt19937_64 random = simulator::make_generator(plan_.seed, simulator::Stream::kImageStamp);
  std::exponential_distribution<double> jitter(1 / kLatencyJitter_s);
  double delivered_s = 0;
  for (int k = 0; k < camera_->frames(); ++k) {
    const double time_s = camera_->time_s(k);
    delivered_s = std::max(delivered_s, time_s + kLatency + jitter(random));
    FrameStamp stamp;
    stamp.frame = k;
    stamp.receive_time_s = kHostEpoch + delivered_s;
    stamp.sender_time_s =
        std::round((17 + time_s * (1 + kSenderSkew)) / kSenderTick_s) * kSenderTick_s;
    stamp.sequence = k;
    stamp.restarted = k == 0;
    frames_.push_back(stamp);
  }
}

void ZoomDay::make_samples() {
  std::mt19937_64 random =
      simulator::make_generator(plan_.seed, simulator::Stream::kTelemetryStamp);
  std::exponential_distribution<double> jitter(1 / kPollJitter_s);
  std::uniform_real_distribution<double> unit(0, 1);
  const DayPath path(config_, plan_.seed);
  simulator::Telemetry head(config_, path);
  double answered_s = 0;
  for (int n = 1; answered_s < config_.duration; ++n) {
    const double asked_s = std::max(answered_s, n * kPollInterval_s);
    const double width_s = kPollLeast_s + jitter(random);
    const simulator::Angles measured = head.measure(asked_s + unit(random) * width_s);
    answered_s = asked_s + width_s;
    PanTiltSample sample;
    sample.earliest_time_s = kHostEpoch + asked_s;
    sample.latest_time_s = kHostEpoch + answered_s;
    sample.pan_rad = measured.pan;
    sample.tilt_rad = measured.tilt;
    sample.zoom = head.zoom();
    sample.restarted = n == 1;
    samples_.push_back(sample);
  }
}

std::vector<std::uint8_t> ZoomDay::image(std::size_t frame) const {
  const auto k = static_cast<int>(frame);
  const cv::Mat image = kept_->frame(k, [&] {
    std::vector<std::uint8_t> pixels = camera_->image(k);
    return cv::Mat(config_.image.height, config_.image.width, CV_8U, pixels.data()).clone();
  });
  std::vector<std::uint8_t> coded;
  cv::imencode(".jpg", image, coded, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  const cv::Mat decoded = cv::imdecode(coded, cv::IMREAD_GRAYSCALE);
  return {decoded.data, decoded.data + decoded.total()};
}

double ZoomDay::telemetry_sigma() const {
  return std::hypot(config_.telemetry.sigma, config_.telemetry.quantum / std::sqrt(12.0));
}

int ZoomDay::rest_of(std::size_t frame) const {
  const double t = camera_->time_s(static_cast<int>(frame));
  const double end_s = t + config_.camera.line_delay * config_.image.height;
  const auto next =
      std::upper_bound(rests_.begin(), rests_.end(), std::max(0.0, std::min(t, end_s)),
                       [](double time_s, const Rest& rest) { return time_s < rest.from_s; });
  const Rest& rest = *std::prev(next);
  return std::max(t, end_s) <= rest.to_s ? static_cast<int>(next - rests_.begin()) - 1 : -1;
}

Calibration ZoomDay::data_sheet() const {
  constexpr double kAxisSigma_rad = 0.05;
  constexpr double kClockOffsetSigma_s = 0.1;
  const simulator::ZoomConfig::Ends& ends = config_.zoom->focal_length;
  Calibration calibration;
  calibration.camera.focal_length = std::sqrt(ends.wide * ends.tele);
  const double f_sigma =
      std::log(ends.tele / ends.wide) / std::sqrt(12.0) * calibration.camera.focal_length;
  calibration.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) =
      f_sigma * f_sigma;
  calibration.camera.width = config_.image.width;
  calibration.camera.height = config_.image.height;
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    calibration.covariance(index(axis), index(axis)) = kAxisSigma_rad * kAxisSigma_rad;
  }
  calibration.covariance(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) =
      kClockOffsetSigma_s * kClockOffsetSigma_s;
  return calibration;
}

}  // namespace alidade::test

#include "test/accuracy/zoom_recording.h"

#include <cmath>
#include <random>
#include <utility>

#include "test/simulator/telemetry.h"
#include "test/simulator/timeline.h"
#include "test/simulator/track_writer.h"

namespace alidade::test {
namespace {

constexpr double kMilliradian = 1e-3;
constexpr double kMargin_s = 1;  // of telemetry, before the first frame and after the last

// The paper's path, as wide at any time as the lens asks for.
class ZoomedPath : public simulator::Path {
 public:
  explicit ZoomedPath(const simulator::Config& config)
      : config_(config), zoom_(simulator::make_zoom(config).value()) {}

  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const double focal_length = std::exp(zoom_.path().at(time_s).log_focal_length);
    const double scale = config_.path.amplitude *
                         simulator::field_of_view(config_.image, focal_length) / simulator::kTwoPi;
    const double angle = simulator::kTwoPi * time_s / config_.path.period;
    return {9 * scale * std::sin(angle), -3 * scale * std::cos(3 * angle)};
  }
  [[nodiscard]] double period_s() const override { return 0; }

 private:
  simulator::Config config_;
  simulator::Zoom zoom_;
};

simulator::Config make_config(const ZoomScenario& scenario, std::uint64_t seed) {
  std::mt19937_64 random(seed * 6364136223846793005u + 11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  simulator::Config c;
  c.seed = seed;
  c.image = {1280, 720, 25};
  c.camera.line_delay = -14.2e-6;
  c.camera.clock_offset = -0.0844;
  c.camera.pan_axis_offset = {uniform(-20, 20) * kMilliradian, uniform(-20, 20) * kMilliradian};
  c.camera.tilt_axis_offset = {uniform(-20, 20) * kMilliradian, uniform(-20, 20) * kMilliradian};
  c.path.amplitude = scenario.amplitude;
  simulator::ZoomConfig zoom;
  zoom.distortion = {uniform(-0.06, -0.02), uniform(-0.01, 0.02)};
  const double direction = uniform(0, simulator::kTwoPi);
  zoom.centre = scenario.centre_px * Eigen::Vector2d(std::cos(direction), std::sin(direction));
  zoom.centre_wander = uniform(-1, 1) * scenario.wander_px;
  zoom.sigma_rep = scenario.sigma_rep;
  zoom.backlash = scenario.backlash;
  zoom.late = scenario.late_s;
  zoom.path.type = simulator::ZoomPathConfig::Type::kDwell;
  const auto add_stop = [&](double focal_length) {
    zoom.path.stops.push_back({std::nullopt, focal_length, scenario.rest_s});
  };
  for (int cycle = 0; cycle < scenario.cycles; ++cycle) {
    const auto count = scenario.focal_lengths.size();
    for (std::size_t i = cycle == 0 ? 0 : 1; i < count; ++i) {
      add_stop(scenario.focal_lengths[cycle % 2 == 0 ? i : count - 1 - i]);
    }
  }
  c.zoom = zoom;
  c.recording.images = simulator::RecordingConfig::Images::kNone;
  c.recording.pixel_sigma = scenario.pixel_sigma;
  c.telemetry.sigma = 5e-5;
  c.timing.image.sigma = 1e-3;
  c.timing.telemetry.sigma = 1e-3;
  // To the end of the last dwell: one rest, and one movement fewer than the path has.
  const simulator::Zoom whole(c);
  const double back = std::abs(std::log(c.zoom->path.stops.back().focal_length.value() /
                                        c.zoom->path.stops.front().focal_length.value()));
  c.duration = whole.path().period_s();
  if (back > 0) {
    // The last movement takes the path back to where it began.
    double last = c.duration;
    const double end = std::log(c.zoom->path.stops.back().focal_length.value());
    while (std::abs(whole.path().at(last - 0.01).log_focal_length - end) > 1e-9) last -= 0.01;
    c.duration = last;
  }
  return c;
}

}  // namespace

ZoomRecording::~ZoomRecording() = default;

ZoomRecording::ZoomRecording(const ZoomScenario& scenario, std::uint64_t seed)
    : config_(make_config(scenario, seed)), path_(std::make_unique<ZoomedPath>(config_)) {
  camera_ = std::make_unique<simulator::CameraModel>(config_.camera, config_.image, *path_,
                                                     simulator::make_zoom(config_));
  input_.width = config_.image.width;
  input_.height = config_.image.height;
  input_.noise.image_stamp_sigma_s = config_.timing.image.sigma;
  input_.noise.telemetry_stamp_sigma_s = config_.timing.telemetry.sigma;
  input_.noise.pan_tilt_sigma_rad = config_.telemetry.sigma;
  std::vector<simulator::FrameEvent> frames;
  simulator::FrameTimeline timeline(config_);
  for (auto event = timeline.next(); event.capture_s < config_.duration; event = timeline.next()) {
    frames.push_back(event);
    input_.frames.push_back({event.frame, event.stamp_s, event.sequence});
  }
  for (const simulator::TrackedPoint& seen : simulator::make_tracks(config_, frames, *camera_)) {
    input_.observations.push_back(
        {seen.frame, seen.landmark, seen.u, seen.v, config_.recording.pixel_sigma});
  }
  simulator::Telemetry telemetry(config_, *path_);
  simulator::JitteredStamps stamps(config_.timing.telemetry, config_.seed,
                                   simulator::Stream::kTelemetryStamp);
  const double rate = config_.telemetry.rate_hz;
  const auto count = std::llround((config_.duration + 2 * kMargin_s) * rate);
  for (std::int64_t i = 0; i < count; ++i) {
    const double time = static_cast<double>(i) / rate - kMargin_s;
    const simulator::Angles angles = telemetry.measure(time);
    const double stamp = stamps.stamp(time) + config_.camera.clock_offset;
    input_.telemetry.push_back({stamp, angles.pan, angles.tilt, i});
    readings_.push_back({stamp, telemetry.zoom().value()});
  }
}

}  // namespace alidade::test

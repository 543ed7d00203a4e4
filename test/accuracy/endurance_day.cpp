#include "test/accuracy/endurance_day.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "test/simulator/random.h"

namespace alidade::test {
namespace {

using simulator::Angles;
using simulator::PatchConfig;

constexpr double kTwoPi = 6.28318530717958647692;
constexpr double kDegree = kTwoPi / 360;

// The two ends of the zoom, for an image 480 wide: 20 and 8 degrees.
struct ZoomEnd {
  double focal_length;  // px of 480
  double radial_distortion;
  std::array<double, 3> looks_past;  // rad, D as a rotation vector in base
};
constexpr ZoomEnd kWide{1361, -0.8, {0.4e-3, -0.9e-3, 1.1e-3}};
constexpr ZoomEnd kNarrow{3432, 3.0, {-0.6e-3, 1.6e-3, -0.8e-3}};
// The head's own axes.
const Eigen::Vector2d kPanAxisOffset(-6e-3, 2e-3);
const Eigen::Vector2d kTiltAxisOffset(3e-3, 8e-3);

constexpr double kReadout = 16e-3;         // s, all rows
constexpr double kExposure = 2e-3;         // s
constexpr double kReadNoise = 2;           // grey levels
constexpr double kLatency = 45e-3;         // s, the least, before any reconnection
constexpr double kLatencyJitter = 1.5e-3;  // s, mean of the exponential
constexpr double kSenderTick = 1.0 / 90000;
constexpr double kPollLeast = 3e-3;   // s, from request to answer
constexpr double kPollJitter = 2e-3;  // s, mean of the exponential
constexpr double kNoticeLoss = 1;     // s of silence until a link counts as lost
constexpr double kLeastRest = 0.3;    // s

// What the path stays within: the photos reach half a wide field further.
constexpr double kPanRange = 18 * kDegree;
constexpr double kTiltRange = 6 * kDegree;
constexpr double kTopSpeed = 7 * kDegree;       // rad/s: 0.9 narrow fields a second
constexpr double kSteadySpeed = 0.8 * kDegree;  // above what counts as no motion in small images

Eigen::Matrix3d rotation(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

Eigen::Vector3d looks_past(const ZoomEnd& end) {
  return Eigen::Map<const Eigen::Vector3d>(end.looks_past.data());
}

double between(double a, double b, double part) { return a + part * (b - a); }

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

// From 0 to 1 with constant velocity but for a fifth of the time at either end.
double sweep_step(double x) {
  constexpr double kEnd = 0.2;
  constexpr double kSpeed = 1 / (1 - kEnd);
  x = std::clamp(x, 0.0, 1.0);
  if (x < kEnd) return kSpeed * x * x / (2 * kEnd);
  if (x > 1 - kEnd) return 1 - kSpeed * (1 - x) * (1 - x) / (2 * kEnd);
  return kSpeed * (x - kEnd / 2);
}

// Quick moves, slow sweeps, weaving, rests, each from rest to rest.
class MixedPath : public simulator::Path {
 public:
  MixedPath(double duration_s, std::uint64_t seed) {
    std::mt19937_64 generator = simulator::make_generator(seed, simulator::Stream::kPath);
    std::uniform_real_distribution<double> unit(-1, 1);
    Part part{0, 0, Part::Kind::kMove, {0, 0}, {0, 0}, 0};
    while (part.start_s <= duration_s) {
      const double choice = unit(generator);
      Angles to{kPanRange * unit(generator), kTiltRange * unit(generator)};
      const double far = std::hypot(to.pan - part.from.pan, to.tilt - part.from.tilt);
      const double haste = 0.65 + 0.35 * unit(generator);  // 0.3 to 1
      if (choice < -0.8) {
        part.kind = Part::Kind::kMove;
        to = part.from;
        part.duration_s = 2 + 4 * std::abs(unit(generator));
      } else if (choice < -0.3) {
        part.kind = Part::Kind::kWeave;
        part.size = 3.5 * kDegree * haste;
        to = part.from;
        part.duration_s = 6 + 8 * std::abs(unit(generator));
      } else if (choice < 0.1) {
        part.kind = Part::Kind::kSweep;
        part.duration_s = std::max(1.0, far / (0.5 * haste * kTopSpeed));
      } else {
        part.kind = Part::Kind::kMove;
        part.duration_s = std::max(0.7, 1.875 * far / (haste * kTopSpeed));
      }
      part.to = to;
      parts_.push_back(part);
      part.start_s += part.duration_s + (unit(generator) < 0 ? 0 : kLeastRest);
      part.from = to;
    }
  }

  Angles at(double time_s) const override {
    const auto next =
        std::upper_bound(parts_.begin(), parts_.end(), time_s,
                         [](double time, const Part& part) { return time < part.start_s; });
    return (next == parts_.begin() ? parts_.front() : *std::prev(next)).at(time_s);
  }
  double period_s() const override { return 0; }

 private:
  struct Part {
    enum class Kind { kMove, kSweep, kWeave };
    double start_s, duration_s;
    Kind kind;
    Angles from, to;
    double size;  // of a weave, rad

    [[nodiscard]] Angles at(double time_s) const {
      const double t = time_s - start_s;
      const double x = t / duration_s;
      if (kind == Kind::kWeave) {
        constexpr double kFade = 1.5;  // s
        constexpr double kPeriod = 5;  // s
        const double fade = smooth_step(t / kFade) * smooth_step((duration_s - t) / kFade);
        const double angle = kTwoPi * t / kPeriod;
        return {from.pan + fade * size * std::sin(angle),
                from.tilt + fade * 0.4 * size * std::sin(3 * angle)};
      }
      const double part = kind == Kind::kSweep ? sweep_step(x) : smooth_step(x);
      return {between(from.pan, to.pan, part), between(from.tilt, to.tilt, part)};
    }
  };

  std::vector<Part> parts_;
};

class SteadyPath : public simulator::Path {
 public:
  SteadyPath(double duration_s, double speed) : middle_(duration_s / 2), speed_(speed) {}
  Angles at(double time_s) const override {
    return {speed_ * (time_s - middle_), 0.3 * speed_ * (time_s - middle_)};
  }
  double period_s() const override { return 0; }

 private:
  double middle_, speed_;
};

std::unique_ptr<simulator::Path> make_day_path(const DayPlan& plan) {
  switch (plan.motion) {
    case DayPlan::Motion::kMixed:
      break;
    case DayPlan::Motion::kConstantVelocity:
      return std::make_unique<SteadyPath>(plan.duration_s, kSteadySpeed);
    case DayPlan::Motion::kAtRest:
      return std::make_unique<SteadyPath>(plan.duration_s, 0);
  }
  return std::make_unique<MixedPath>(plan.duration_s, plan.seed);
}

simulator::SceneConfig make_scene(bool plain, const std::filesystem::path& scenes) {
  simulator::SceneConfig scene;
  scene.background = 0.7;
  if (plain) return scene;
  PatchConfig left;
  left.file = scenes / "picosdeeuropa_by_Aitzol_Berasategi.jpg";
  left.azimuth = -17 * kDegree;
  left.width = 36 * kDegree;
  PatchConfig right = left;
  right.file = scenes / "aitzgorri_by_Aitzol_Berasategi.jpg";
  right.azimuth = 17 * kDegree;
  scene.photos = {left, right};
  PatchConfig behind;
  behind.width = 76 * kDegree;
  behind.height = 44 * kDegree;
  scene.procedural = {behind};
  return scene;
}

std::vector<float> normal_quantiles(std::uint64_t seed) {
  std::mt19937_64 generator = simulator::make_generator(seed, simulator::Stream::kPixel);
  std::normal_distribution<float> normal;
  std::vector<float> values(1 << 16);
  for (float& value : values) value = normal(generator);
  return values;
}

constexpr double kMinute = 60;  // s

}  // namespace

DayPlan hour_plan(DayPlan::Bump::Kind bump) {
  using Link = DayPlan::Loss::Link;
  DayPlan plan;
  plan.name = bump == DayPlan::Bump::Kind::kBase ? "hour, base bumped" : "hour, camera bumped";
  plan.duration_s = 60 * kMinute;
  plan.zooms = {{5 * kMinute, 1},  {11 * kMinute, 0}, {17 * kMinute, 1}, {23 * kMinute, 0},
                {33 * kMinute, 1}, {39 * kMinute, 0}, {48 * kMinute, 1}, {54 * kMinute, 0}};
  plan.bumps = {{bump, 36 * kMinute, 5e-3}};
  plan.losses = {{Link::kVideo, 8 * kMinute, 8 * kMinute + 5, 3e-3},
                 {Link::kTelemetry, 27 * kMinute, 27 * kMinute + 12, 0},
                 {Link::kVideo, 44 * kMinute, 44 * kMinute + 20, -5e-3}};
  return plan;
}

void make_coarse(DayPlan* plan) {
  plan->width = 320;
  plan->height = 180;
  plan->rate_hz = 10;
}

std::vector<UnsuitableDay> unsuitable_days() {
  DayPlan steady;
  steady.name = "constant velocity";
  steady.motion = DayPlan::Motion::kConstantVelocity;
  DayPlan rest;
  rest.name = "no motion";
  rest.motion = DayPlan::Motion::kAtRest;
  DayPlan plain;
  plain.name = "plain scene";
  plain.plain_scene = true;
  for (DayPlan* plan : {&steady, &rest, &plain}) make_coarse(plan);
  return {{steady, CalibrationNeed::kAcceleration},
          {rest, CalibrationNeed::kMotion},
          {plain, CalibrationNeed::kTexture}};
}

DayPlan small_day_plan() {
  using Link = DayPlan::Loss::Link;
  DayPlan plan;
  plan.name = "small";
  plan.duration_s = 150;
  make_coarse(&plan);
  plan.zooms = {{40, 1}, {65, 0}};
  plan.losses = {{Link::kVideo, 80, 83, 3e-3},
                 {Link::kTelemetry, 105, 109, 0},
                 {Link::kVideo, 120, 123, -5e-3}};
  plan.bumps = {{DayPlan::Bump::Kind::kBase, 135, 5e-3}};
  return plan;
}

VirtualDay::VirtualDay(const DayPlan& plan, const std::filesystem::path& scenes)
    : plan_(plan),
      path_(make_day_path(plan)),
      telemetry_sigma_(1e-4),
      noise_(normal_quantiles(plan.seed)) {
  config_.seed = plan.seed;
  config_.image = {plan.width, plan.height, plan.rate_hz};
  config_.camera.line_delay = kReadout / plan.height;
  config_.camera.pan_axis_offset = kPanAxisOffset;
  config_.camera.tilt_axis_offset = kTiltAxisOffset;
  config_.telemetry.sigma = telemetry_sigma_;
  const auto lens_of = [this](double zoom) {
    simulator::CameraConfig camera = config_.camera;
    camera.focal_length = std::pow(kWide.focal_length, 1 - zoom) *
                          std::pow(kNarrow.focal_length, zoom) * plan_.width / 480;
    camera.radial_distortion = between(kWide.radial_distortion, kNarrow.radial_distortion, zoom);
    return std::make_shared<const simulator::CameraModel>(camera, config_.image, *path_);
  };
  wide_ = lens_of(0);
  narrow_ = lens_of(1);

  std::vector<Eigen::Vector3d> seen;
  constexpr double kMargin = 11.5 * kDegree;  // half a wide field and more
  const double pan = kPanRange + kMargin;
  const double tilt = kTiltRange + kMargin;
  for (int i = -8; i <= 8; ++i) {
    for (int j = -8; j <= 8; ++j) seen.push_back(simulator::direction(pan * i / 8, tilt * j / 8));
  }
  const bool zooms = !plan.zooms.empty();
  const double focal_length = (zooms ? kNarrow : kWide).focal_length * plan.width / 480;
  scene_ = std::make_unique<simulator::Scene>(
      make_scene(plan.plain_scene, scenes),
      std::vector<simulator::Sight>{{focal_length, std::move(seen)}}, false, plan.seed);
  make_frames();
  make_samples();
  make_events();
}

double VirtualDay::acceleration_sigma() const {
  return 0.2;  // of this path's quick moves
}

void VirtualDay::make_frames() {
  std::mt19937_64 generator = simulator::make_generator(plan_.seed, simulator::Stream::kImageStamp);
  std::exponential_distribution<double> jitter(1 / kLatencyJitter);
  double latency = kLatency;
  double sender_epoch = 17;
  double delivered = 0;
  bool restarted = false;
  std::int64_t first_sequence = 0;
  const auto count = static_cast<std::int64_t>(plan_.duration_s * plan_.rate_hz);
  auto loss = plan_.losses.begin();
  for (std::int64_t n = 0; n < count; ++n) {
    const double time = static_cast<double>(n) / plan_.rate_hz;
    while (loss != plan_.losses.end() && (loss->link != DayPlan::Loss::Link::kVideo)) ++loss;
    if (loss != plan_.losses.end() && time >= loss->from_s) {
      if (time < loss->to_s) continue;
      latency += loss->latency_change_s;
      sender_epoch = 1000 * std::fmod(sender_epoch * 1.37, 1.0);
      restarted = true;
      first_sequence = n;
      ++loss;
    }
    delivered = std::max(delivered, time + latency + jitter(generator));
    FrameStamp stamp;
    stamp.frame = static_cast<std::int64_t>(frames_.size());
    stamp.receive_time_s = kHostEpoch + delivered;
    stamp.sender_time_s =
        std::round((sender_epoch + time * (1 + plan_.sender_skew)) / kSenderTick) * kSenderTick;
    stamp.sequence = n - first_sequence;
    stamp.restarted = restarted || frames_.empty();
    restarted = false;
    frames_.push_back(stamp);
    captures_.push_back({time, latency});
  }
}

void VirtualDay::make_samples() {
  std::mt19937_64 generator =
      simulator::make_generator(plan_.seed, simulator::Stream::kTelemetryStamp);
  std::exponential_distribution<double> jitter(1 / kPollJitter);
  std::uniform_real_distribution<double> unit(0, 1);
  simulator::Telemetry head(config_, *path_);
  const auto lost = [this](double time) {
    return std::any_of(plan_.losses.begin(), plan_.losses.end(), [&](const DayPlan::Loss& loss) {
      return loss.link == DayPlan::Loss::Link::kTelemetry && time >= loss.from_s &&
             time < loss.to_s;
    });
  };
  bool restarted = true;
  double answered = -1;
  for (std::int64_t n = 0;; ++n) {
    // The next question is asked when the answer to the last one is there.
    const double asked = std::max(answered, static_cast<double>(n) / plan_.telemetry_rate_hz - 1);
    const double width = kPollLeast + jitter(generator);
    const double true_at = asked + unit(generator) * width;
    if (asked > plan_.duration_s) return;
    answered = asked + width;
    if (lost(asked)) {
      restarted = true;
      continue;
    }
    const Angles measured = head.measure(true_at);
    PanTiltSample sample;
    sample.earliest_time_s = kHostEpoch + asked;
    sample.latest_time_s = kHostEpoch + answered;
    sample.pan_rad = measured.pan;
    sample.tilt_rad = measured.tilt;
    sample.zoom = zoom_at(true_at);
    sample.restarted = restarted;
    restarted = false;
    samples_.push_back(sample);
  }
}

void VirtualDay::make_events() {
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    events_.push_back({DayEvent::Kind::kFrame, frames_[i].receive_time_s, i});
  }
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    events_.push_back({DayEvent::Kind::kSample, samples_[i].latest_time_s, i});
  }
  for (const DayPlan::Loss& loss : plan_.losses) {
    events_.push_back({loss.link == DayPlan::Loss::Link::kVideo ? DayEvent::Kind::kVideoLost
                                                                : DayEvent::Kind::kTelemetryLost,
                       kHostEpoch + loss.from_s + kNoticeLoss, 0});
  }
  std::stable_sort(events_.begin(), events_.end(), [](const DayEvent& a, const DayEvent& b) {
    return a.host_time_s < b.host_time_s;
  });
}

std::vector<DayMark> VirtualDay::marks() const {
  std::vector<DayMark> marks{{"start", 0}};
  for (const auto& zoom : plan_.zooms) {
    marks.push_back({zoom.to > 0.5 ? "zoomed in" : "zoomed out", zoom.time_s + kZoomRamp});
  }
  for (const auto& bump : plan_.bumps) {
    marks.push_back(
        {bump.kind == DayPlan::Bump::Kind::kBase ? "base bumped" : "camera bumped", bump.time_s});
  }
  for (const auto& loss : plan_.losses) {
    marks.push_back(
        {loss.link == DayPlan::Loss::Link::kVideo ? "video back" : "telemetry back", loss.to_s});
  }
  marks.erase(std::remove_if(marks.begin(), marks.end(),
                             [this](const DayMark& mark) {
                               return mark.time_s < 0 || mark.time_s >= plan_.duration_s;
                             }),
              marks.end());
  std::sort(marks.begin(), marks.end(),
            [](const DayMark& a, const DayMark& b) { return a.time_s < b.time_s; });
  return marks;
}

double VirtualDay::zoom_part(double time_s) const {
  double part = 0;
  for (const DayPlan::ZoomChange& change : plan_.zooms) {
    if (time_s < change.time_s) break;
    part = between(part, change.to, smooth_step((time_s - change.time_s) / kZoomRamp));
  }
  return part;
}

double VirtualDay::zoom_at(double time_s) const {
  return std::round(between(kWideZoom, kNarrowZoom, zoom_part(time_s)));
}

VirtualDay::Optics VirtualDay::optics_at(double time_s) const {
  const double zoom = zoom_part(time_s);
  Optics optics;
  optics.focal_length = std::pow(kWide.focal_length, 1 - zoom) *
                        std::pow(kNarrow.focal_length, zoom) * plan_.width / 480;
  optics.radial_distortion = between(kWide.radial_distortion, kNarrow.radial_distortion, zoom);
  optics.boresight = rotation(looks_past(kWide) + zoom * (looks_past(kNarrow) - looks_past(kWide)));
  optics.mount = Eigen::Matrix3d::Identity();
  for (const DayPlan::Bump& bump : plan_.bumps) {
    if (time_s < bump.time_s) continue;
    const Eigen::Matrix3d turn = rotation(bump.size * Eigen::Vector3d(0.45, 0.6, 0.7).normalized());
    Eigen::Matrix3d& moved =
        bump.kind == DayPlan::Bump::Kind::kBase ? optics.mount : optics.boresight;
    moved = turn * moved;
  }
  return optics;
}

std::shared_ptr<const simulator::CameraModel> VirtualDay::lens_at(double time_s) const {
  const double zoom = zoom_part(time_s);
  if (zoom == 0) return wide_;
  if (zoom == 1) return narrow_;
  const Optics optics = optics_at(time_s);
  simulator::CameraConfig camera = config_.camera;
  camera.focal_length = optics.focal_length;
  camera.radial_distortion = optics.radial_distortion;
  return std::make_shared<const simulator::CameraModel>(camera, config_.image, *path_);
}

Eigen::Matrix3d VirtualDay::head_from_camera(const Optics& optics, double time_s) const {
  const Angles angles = path_->at(time_s);
  Eigen::Matrix3d frd_from_rdf;
  frd_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::AngleAxisd(angles.pan, wide_->pan_axis()).toRotationMatrix() *
         Eigen::AngleAxisd(angles.tilt, wide_->tilt_axis()).toRotationMatrix() * optics.boresight *
         frd_from_rdf;
}

Eigen::Matrix3d VirtualDay::base_from_camera(std::size_t frame, double row) const {
  const Optics optics = optics_at(time(frame));
  return optics.boresight.transpose() *
         head_from_camera(optics, time(frame) + row * config_.camera.line_delay);
}

Eigen::Vector3d VirtualDay::direction(std::size_t frame, const Eigen::Vector2d& u) const {
  const Eigen::Vector2d slope = lens_at(time(frame))->slope(u.x(), u.y());
  return base_from_camera(frame, u.y()) * slope.homogeneous().normalized();
}

Calibration VirtualDay::calibration(std::size_t frame) const {
  const Optics optics = optics_at(time(frame));
  Calibration calibration;
  calibration.camera = {
      optics.focal_length, 1, {optics.radial_distortion}, plan_.width, plan_.height};
  calibration.line_delay = config_.camera.line_delay;
  calibration.mechanics = {optics.boresight.transpose() * wide_->pan_axis(),
                           optics.boresight.transpose() * wide_->tilt_axis(), 1, 1};
  calibration.clock_offset = -captures_[frame].latency_s;
  calibration.zoom = zoom(frame);
  return calibration;
}

void VirtualDay::render(std::size_t frame, std::uint8_t* image) const {
  // Where in a pixel, and when in the exposure, its four samples lie.
  constexpr std::array<std::array<double, 2>, 4> kPoints{
      {{0.125, 0.375}, {-0.375, 0.125}, {0.375, -0.125}, {-0.125, -0.375}}};
  const double start = time(frame);
  const Optics optics = optics_at(start);
  const auto lens = lens_at(start);
  const auto width = static_cast<std::size_t>(plan_.width);
  std::vector<double> x(width);
  std::vector<double> y(width);
  std::vector<float> signal(width);
  std::mt19937_64 bits(simulator::mix(plan_.seed, frame));
  for (int row = 0; row < plan_.height; ++row) {
    std::fill(signal.begin(), signal.end(), 0.0F);
    for (std::size_t i = 0; i < kPoints.size(); ++i) {
      const auto& [du, dv] = kPoints.at(i);
      for (std::size_t column = 0; column < width; ++column) {
        const Eigen::Vector2d slope =
            lens->slope(static_cast<double>(column) + 0.5 + du, row + 0.5 + dv);
        x[column] = slope.x();
        y[column] = slope.y();
      }
      const double time = start + (row + 0.5) * config_.camera.line_delay +
                          kExposure * ((static_cast<double>(i) + 0.5) / kPoints.size() - 0.5);
      scene_->shade(optics.mount * head_from_camera(optics, time), time, optics.focal_length,
                    x.data(), y.data(), width, 1.0F / kPoints.size(), signal.data());
    }
    std::uint64_t random = 0;
    for (std::size_t column = 0; column < width; ++column) {
      if (column % 4 == 0) random = bits();
      const float normal = noise_[random & 0xffffU];
      random >>= 16;
      const float grey = 255 * signal[column] + static_cast<float>(kReadNoise) * normal + 0.5F;
      *image++ = static_cast<std::uint8_t>(std::clamp(grey, 0.0F, 255.0F));
    }
  }
}

}  // namespace alidade::test

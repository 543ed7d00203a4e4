// Tracks of the virtual camera's video, against where the truth says that the point of a landmark's first
// frame lies. The tracker is told nothing of the camera.

#include "core/realtime/start_up_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "test/core/realtime/analytic_image.h"
#include "test/simulator/renderer.h"

namespace alidade::test {
namespace {

namespace sim = simulator;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr double kFrame = 0.04;  // s

// A far landscape all around, seen with a field of view of so many degrees.
sim::Config camera(double field_deg, double k_r2_in_corners) {
  sim::Config config;
  config.seed = 11;
  config.image = {640, 360, 25};
  config.duration = 10;
  const double slope = std::tan(0.5 * field_deg * kDegree);
  config.camera.focal_length = 0.5 * 640 / slope;
  const double corner = slope * std::hypot(640, 360) / 640;
  config.camera.radial_distortion = k_r2_in_corners / (corner * corner);
  config.path.amplitude = 0;
  config.sensor.exposure = 0.002;
  config.sensor.read_noise = 2;
  sim::PatchConfig photo;
  photo.file = std::string(ALIDADE_TEST_DATA) + "/picosdeeuropa_by_Aitzol_Berasategi.jpg";
  photo.width = std::min(4.5 * field_deg, 150.0) * kDegree;
  config.scene.photos.push_back(photo);
  sim::PatchConfig around;
  around.width = 2 * kPi;
  around.height = kPi;
  around.projection = sim::PatchConfig::Projection::kEquirectangular;
  if (field_deg > 10) config.scene.procedural.push_back(around);
  return config;
}

// Pan and tilt as functions of the time.
class GivenPath : public sim::Path {
 public:
  explicit GivenPath(std::function<sim::Angles(double)> at) : at_(std::move(at)) {}
  [[nodiscard]] sim::Angles at(double time_s) const override { return at_(time_s); }
  [[nodiscard]] double period_s() const override { return 0; }

 private:
  std::function<sim::Angles(double)> at_;
};

// Swings with one field of view a second at most, to the side and up and down.
std::function<sim::Angles(double)> swing(double field_deg, double fields_a_second = 1) {
  const double amplitude = fields_a_second * field_deg * kDegree / (2 * kPi * 0.6);
  return [amplitude](double t) {
    return sim::Angles{amplitude * std::sin(2 * kPi * 0.6 * t),
                       0.3 * amplitude * std::sin(2 * kPi * 0.45 * t + 1)};
  };
}

// The scene point at a pixel of a frame, and where another frame shows it.
class Truth {
 public:
  Truth(const sim::Config& config, const sim::Path& path)
      : camera_(config.camera, config.image, path), line_delay_(config.camera.line_delay) {}

  [[nodiscard]] Vector3d direction(const Vector2d& u, double t0) const {
    const Vector2d slope = camera_.slope(u.x(), u.y());
    return camera_.base_from_camera_at(t0 + line_delay_ * u.y()) *
           Vector3d(slope.x(), slope.y(), 1).normalized();
  }
  [[nodiscard]] std::optional<Vector2d> pixel(const Vector3d& d, double t0) const {
    return camera_.project_rolling(d, t0);
  }

 private:
  sim::CameraModel camera_;
  double line_delay_;
};

// Errors of all observations but the first of each landmark, after what they have in common is taken out
// of each track: that is its landmark's, not theirs.
struct Errors {
  int observations = 0;
  int landmarks = 0;      // seen twice or more
  double length = 0;      // mean number of observations of these
  double rms = 0;         // px, each component, of believable ones
  double normalised = 0;  // mean of e' cov^-1 e / 2, of believable ones; 1 if covariances are right
  Vector2d mean = Vector2d::Zero();
  double wrong = 0;          // share with an error beyond 1 px
  double landmark_rms = 0;   // px, what the observations of a track have in common
  double drift_px = 0;       // rms difference between last and first quarter of long tracks
};

struct Run {
  Errors errors;
  std::vector<StartUpStatistics> statistics;
};

struct Sight {
  int frame;
  Vector2d u;
  Matrix2<double> covariance;
};

Errors judge(const std::map<std::uint32_t, std::vector<Sight>>& tracks, const Truth& truth) {
  Errors errors;
  double square = 0;
  double normalised = 0;
  double believable = 0;
  double landmark_square = 0;
  double drift_square = 0;
  int drifts = 0;
  int wrong = 0;
  for (const auto& [landmark, sights] : tracks) {
    if (sights.size() < 2) continue;
    const Vector3d d = truth.direction(sights[0].u, kFrame * sights[0].frame);
    std::vector<Vector2d> error;
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2d weighted = Vector2d::Zero();
    for (const Sight& sight : sights) {
      const auto u = truth.pixel(d, kFrame * sight.frame);
      error.push_back(u ? Vector2d(sight.u - *u) : Vector2d(1e3, 1e3));
      if (error.back().norm() > 1) continue;
      information += sight.covariance.inverse();
      weighted += sight.covariance.inverse() * error.back();
    }
    const Vector2d common = information.inverse() * weighted;
    ++errors.landmarks;
    landmark_square += common.squaredNorm() / 2;
    const auto n = static_cast<double>(sights.size());
    for (std::size_t i = 0; i < sights.size(); ++i) {
      ++errors.observations;
      const Vector2d left = error[i] - common;
      if (error[i].norm() > 1) {
        ++wrong;
        continue;
      }
      errors.mean += left;
      square += left.squaredNorm() / 2;
      // One of n observations went into what they have in common.
      normalised += left.dot(sights[i].covariance.inverse() * left) / 2;
      believable += (n - 1) / n;
    }
    if (sights.size() >= 20) {
      Vector2d first = Vector2d::Zero();
      Vector2d last = Vector2d::Zero();
      for (std::size_t i = 0; i < 5; ++i) {
        first += error[i] / 5;
        last += error[error.size() - 1 - i] / 5;
      }
      drift_square += (last - first).squaredNorm() / 2;
      ++drifts;
    }
  }
  const int good = std::max(errors.observations - wrong, 1);
  errors.length = static_cast<double>(errors.observations) / std::max(errors.landmarks, 1);
  errors.rms = std::sqrt(square / std::max(believable, 1.0));
  errors.normalised = normalised / std::max(believable, 1.0);
  errors.mean /= good;
  errors.wrong = static_cast<double>(wrong) / std::max(errors.observations, 1);
  errors.landmark_rms = std::sqrt(landmark_square / std::max(errors.landmarks, 1));
  errors.drift_px = std::sqrt(drift_square / std::max(drifts, 1));
  return errors;
}

Run track(const sim::Config& config, const std::function<sim::Angles(double)>& angles, int frames) {
  const GivenPath path(angles);
  const sim::Renderer renderer(config, path);
  const Truth truth(config, path);
  StartUpTracker tracker({config.image.width, config.image.height});
  std::map<std::uint32_t, std::vector<Sight>> tracks;
  Run run;
  for (int frame = 0; frame < frames; ++frame) {
    const std::vector<std::uint8_t> pixels = renderer.render(kFrame * frame, frame);
    (void)tracker.process(
        {pixels.data(), config.image.width, config.image.height, config.image.width});
    run.statistics.push_back(tracker.statistics());
    for (int i = 0; i < tracker.observation_count(); ++i) {
      const TrackObservation& seen = tracker.observations()[i];
      tracks[seen.landmark].push_back({frame, seen.u, seen.covariance});
    }
  }
  run.errors = judge(tracks, truth);
  const Errors& e = run.errors;
  std::printf(
      "%6d observations, %5d landmarks of %5.1f; rms %.4f px, normalised %.2f, bias %.4f %.4f, wrong "
      "%.2f %%, landmark %.4f px, drift %.4f px, noise %.2f\n",
      e.observations, e.landmarks, e.length, e.rms, e.normalised, e.mean.x(), e.mean.y(),
      100 * e.wrong, e.landmark_rms, e.drift_px, run.statistics.back().noise);
  return run;
}


TEST(StartUpTracker, Explore) {
  {
    sim::Config config = camera(60, 0.07);
    sim::PatchConfig object;
    object.file = config.scene.photos[0].file;
    std::printf("moving 30 percent\n");
    object.width = 18 * kDegree; object.height = 17 * kDegree;
    for (double a : {-16.0, 14.0}) { object.azimuth = a * kDegree; object.azimuth_rate = 10 * kDegree; object.elevation = 0.2*a*kDegree;
    object.brightness = 0.3; config.scene.moving.push_back(object); }
    track(config, swing(60, 0.3), 40);
  }
  {
    sim::Config config = camera(60, 0.07);
    std::printf("rests, object slow\n");
    sim::PatchConfig object;
    object.width = 20 * kDegree; object.height = 17 * kDegree;
    object.file = config.scene.photos[0].file;
    object.azimuth_rate = 1 * kDegree;
    config.scene.moving.push_back(object);
    track(config, [](double) { return sim::Angles{0.1, 0.1}; }, 30);
  }
  {
    sim::Config config = camera(60, 0.07);
    std::printf("3 fields a second\n");
    track(config, swing(60, 3), 40);
  }
  {
    sim::Config config = camera(100, 0.0);
    std::printf("100 degrees\n");
    config.scene.photos.clear();
    track(config, swing(60, 1), 40);
  }
  {
    sim::Config config = camera(60, 0.07);
    config.scene.photos.clear();
    std::printf("60 degrees, tilt -70\n");
    const auto s = swing(60, 3);
    track(config, [s](double t) { auto a = s(t); a.tilt = 0.2*a.tilt -70 * kDegree; return a; }, 40);
  }
  {
    sim::Config config = camera(20, 0.07);
    std::printf("brightness step, cover\n");
    config.sensor.brightness_steps.push_back({0.39, 0.5});
    config.sensor.covered.push_back({0.79, 0.83});
    config.sensor.covered.push_back({1.19, 1.43});
    const auto run = track(config, swing(20, 1), 45);
    for (auto& s : run.statistics) std::printf("%d:%d/%d/%d+%d-%d(%.1f) ", static_cast<int>(s.status), s.looked_for, s.found, s.believed, s.begun, s.ended, s.noise);
    std::printf("\n");
  }
}

}  // namespace
}  // namespace alidade::test

#include "test/accuracy/pattern_detections.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <map>
#include <optional>
#include <stdexcept>

#include "core/pattern/pattern_detector.h"
#include "test/simulator/pattern_renderer.h"
#include "test/simulator/pattern_scene.h"

namespace alidade::test {
namespace {

using Eigen::Vector2d;
using Kind = simulator::PatternConfig::Kind;

constexpr double kWrong_px = 0.5;
constexpr double kStep_s = 1e-4;  // of the image's motion by differences

double cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

using Truth = std::vector<std::optional<Vector2d>>;

Truth truth_of(const simulator::PatternRenderer& renderer, double time_s) {
  Truth truth;
  for (const Vector2d& place : renderer.board().points())
    truth.push_back(renderer.camera().project_rolling(place, time_s));
  return truth;
}

// Named from either end where the pattern looks the same from both.
void name_as_truth(const KnownPattern& pattern, const Truth& truth,
                   std::vector<PatternObservation>* found) {
  if (!pattern.is_symmetric()) return;
  const auto last = static_cast<int>(truth.size()) - 1;
  double same = 0;
  double turned = 0;
  for (const PatternObservation& o : *found) {
    const auto& there = truth[static_cast<std::size_t>(o.point)];
    const auto& other = truth[static_cast<std::size_t>(last - o.point)];
    if (there) same += (o.u - *there).norm();
    if (other) turned += (o.u - *other).norm();
  }
  if (turned >= same) return;
  for (PatternObservation& o : *found) o.point = last - o.point;
}

}  // namespace

const std::vector<PatternUnderTest>& patterns_under_test() {
  static const std::vector<PatternUnderTest> patterns = [] {
    std::vector<PatternUnderTest> all = {
        {"chessboard:9x6:30mm", Kind::kChessboard, 9, 6, 0.030},
        {"circles:4x11:25mm", Kind::kCircles, 4, 11, 0.025},
        {"symmetric-circles:9x6:30mm", Kind::kSymmetricCircles, 9, 6, 0.030},
        {"aprilgrid:6x6:27mm:0.3", Kind::kAprilGrid, 6, 6, 0.027}};
    if (simulator::PatternBoard::has_charuco())
      all.push_back({"charuco:10x7:30mm:22mm", Kind::kCharuco, 10, 7, 0.030});
    return all;
  }();
  return patterns;
}

KnownPattern known(const PatternUnderTest& pattern) {
  std::string error;
  const std::optional<KnownPattern> parsed = parse_pattern(pattern.name, &error);
  if (!parsed) throw std::logic_error(error);
  return *parsed;
}

simulator::Config pattern_scene(const PatternUnderTest& pattern) {
  simulator::Config config =
      simulator::pattern_scene(pattern.kind, pattern.columns, pattern.rows, pattern.size_m);
  config.camera.line_delay = 51.56e-6;
  config.sensor.jpeg_quality = 95;
  return config;
}

DetectionErrors detection_errors(const simulator::Config& config, const KnownPattern& pattern,
                                 int frames, double interval_s) {
  const simulator::PatternRenderer renderer(config);
  PatternDetector detector(pattern);
  DetectionErrors errors;
  double squares = 0;
  double along = 0;
  int right = 0;
  double products = 0;
  double product_squares = 0;
  std::map<int, Vector2d> before;
  for (int f = 0; f < frames; ++f) {
    const double time_s = f * interval_s;
    const Truth truth = truth_of(renderer, time_s);
    const Truth later = truth_of(renderer, time_s + kStep_s);
    const std::vector<std::uint8_t> image = renderer.render(time_s, f);
    const double start_s = cpu_s();
    std::vector<PatternObservation> found =
        detector.find(image.data(), config.image.width, config.image.height, config.image.width);
    errors.cpu_ms += 1e3 * (cpu_s() - start_s) / frames;
    name_as_truth(pattern, truth, &found);
    ++errors.frames;
    errors.frames_found += found.empty() ? 0 : 1;
    for (const auto& there : truth) {
      errors.seen += there && there->x() > 0 && there->y() > 0 && there->x() < config.image.width &&
                             there->y() < config.image.height
                         ? 1
                         : 0;
    }
    std::map<int, Vector2d> now;
    for (const PatternObservation& o : found) {
      ++errors.found;
      const auto& there = truth[static_cast<std::size_t>(o.point)];
      const auto& then = later[static_cast<std::size_t>(o.point)];
      if (!there || !then || (o.u - *there).norm() > kWrong_px) {
        ++errors.wrong;
        continue;
      }
      const Vector2d error = o.u - *there;
      const Vector2d motion = *then - *there;
      squares += error.squaredNorm();
      if (motion.norm() > 0) along += error.dot(motion.normalized());
      ++right;
      now[o.point] = error;
      const auto last = before.find(o.point);
      if (last == before.end()) continue;
      products += error.dot(last->second);
      product_squares += 0.5 * (error.squaredNorm() + last->second.squaredNorm());
    }
    before = now;
  }
  errors.rms_px = right > 0 ? std::sqrt(squares / (2 * right)) : 0;
  errors.along_px = right > 0 ? along / right : 0;
  errors.correlation = product_squares > 0 ? products / product_squares : 0;
  return errors;
}

Table detection_table(int frames) {
  struct Condition {
    const char* name;
    double speed, exposure_s, noise, interval_s, distance;
  };
  // At rest: each frame is a new pose, 7 s later on a path a hundred times slower, so that nothing moves while it is read out.
  constexpr Condition kConditions[] = {{"at rest", 0.001, 0, 0, 700, 0.55},
                                       {"at rest, noise 2", 0.001, 0, 2, 700, 0.55},
                                       {"moving", 1, 0, 2, 0.05, 0.55},
                                       {"moving, 4 ms", 1, 4e-3, 2, 0.05, 0.55},
                                       {"moving, 16 ms", 1, 16e-3, 2, 0.05, 0.55}};
  Table table;
  table.title = "detections in rendered frames";
  table.header = {"pattern", "frames found", "points found", "wrong",
                  "rms px",  "along px",     "correlation",  "CPU ms"};
  for (const PatternUnderTest& pattern : patterns_under_test()) {
    for (const Condition& condition : kConditions) {
      simulator::Config config = pattern_scene(pattern);
      config.pattern->hand.speed = condition.speed;
      config.pattern->hand.distance = condition.distance;
      config.sensor.exposure = condition.exposure_s;
      config.sensor.read_noise = condition.noise;
      const DetectionErrors e =
          detection_errors(config, known(pattern), frames, condition.interval_s);
      table.rows.push_back({pattern.name + ", " + condition.name,
                            std::to_string(e.frames_found) + " of " + std::to_string(e.frames),
                            std::to_string(e.found) + " of " + std::to_string(e.seen),
                            std::to_string(e.wrong), number(e.rms_px), number(e.along_px, 2),
                            number(e.correlation, 2), number(e.cpu_ms)});
    }
  }
  return table;
}

}  // namespace alidade::test

// What a frame's orientation from the picture costs, beside two ways to have it from OpenCV, on the same
// frames in the same run, one thread each:
//   oe            OeMode::process() with N landmarks, and beside it maintain(), which may come later
//   lucas_kanade  FAST on every frame, pyramidal Lucas-Kanade (21x21, 4 octaves) on N of its corners from
//                 the frame before, rotation by Kabsch with Huber weights
//   orb           N ORB features of every frame, matched by brute force to the N of the nearest of five
//                 key frames (the map), homography by RANSAC; the way of Lisanti et al.'s mapping
// Both get the mount's rate for the rolling shutter for nothing where they can use it, and the pyramid of
// the frame before is kept. Frames that fill the map or the caches first are not counted.
// error_px: of the turn from one frame to the next against truth, RMS over frames, over centre and
// corners, and over u and v. ratio: median over the median of oe in this run.
// Times of a way follow from a list of all its frames; a table of them is printed at the end.

#include <benchmark/benchmark.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <vector>

#include "core/model/camera.h"
#include "core/realtime/oe_mode.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kFrames = 40;

double milliseconds(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Times of one thing, frame by frame, ms.
class Times {
 public:
  void add(double ms) { values_.push_back(ms); }
  [[nodiscard]] double quantile(double q) const {
    std::vector<double> sorted = values_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(
        std::lround(q * static_cast<double>(sorted.size() - 1)))];
  }

 private:
  std::vector<double> values_;
};

// Only the pictures of one size are held at a time.
TurningCamera& camera_of(int height) {
  static std::unique_ptr<TurningCamera> camera;
  if (camera == nullptr || camera->calibration().camera.height != height) {
    camera.reset();
    camera = std::make_unique<TurningCamera>(height, kFrames);
  }
  return *camera;
}

// Differences between the directions that a way gives to a few pixels and their true ones.
class Errors {
 public:
  explicit Errors(const TurningCamera& camera) : camera_(camera) {
    const double w = camera.calibration().camera.width;
    const double h = camera.calibration().camera.height;
    grid_ = {Vector2<double>(0.5 * w, 0.5 * h),
             {0.05 * w, 0.05 * h},
             {0.95 * w, 0.05 * h},
             {0.05 * w, 0.95 * h},
             {0.95 * w, 0.95 * h}};
  }

  using Direction = std::function<bool(const Vector2<double>&, Vector3<double>*)>;

  // direction: as estimated, false if there is none.
  void add(int k, const Direction& direction) {
    std::array<Vector3<double>, 5> errors;
    bool known = true;
    for (std::size_t i = 0; i < grid_.size(); ++i) {
      Vector3<double> d;
      known = known && direction(grid_[i], &d);
      if (known) errors[i] = d - camera_.direction(k, grid_[i]);
    }
    if (known && known_before_) {
      for (std::size_t i = 0; i < grid_.size(); ++i) sum_ += (errors[i] - before_[i]).squaredNorm();
      count_ += 2 * grid_.size();
    }
    before_ = errors;
    known_before_ = known;
    known_count_ += static_cast<std::size_t>(known);
  }
  [[nodiscard]] double rms_px() const {
    return camera_.calibration().camera.focal_length *
           std::sqrt(sum_ / static_cast<double>(std::max<std::size_t>(count_, 1)));
  }
  [[nodiscard]] std::size_t frames_with_result() const { return known_count_; }

 private:
  const TurningCamera& camera_;
  std::array<Vector2<double>, 5> grid_;
  std::array<Vector3<double>, 5> before_;
  bool known_before_ = false;
  double sum_ = 0;
  std::size_t count_ = 0;
  std::size_t known_count_ = 0;
};

// A line of the table.
struct Row {
  std::string way;
  int height = 0;
  int points = 0;
  std::string part;
  double p50 = 0, p99 = 0, max = 0, ratio = 0, error_px = 0, held = 0;
};
std::vector<Row> table;

// Writes a part's times to the JSON and to the table.
void report(benchmark::State& state, const char* way, const char* part, const Times& times,
            double error_px = 0, double held = 0) {
  Row row{way,
          static_cast<int>(state.range(0)),
          static_cast<int>(state.range(1)),
          part,
          times.quantile(0.5),
          times.quantile(0.99),
          times.quantile(1),
          0,
          error_px,
          held};
  for (const Row& other : table) {
    if (other.way == "oe" && other.part == "process" && other.height == row.height &&
        other.points == row.points) {
      row.ratio = row.p50 / other.p50;
    }
  }
  const std::string prefix = std::string(part) + "_";
  state.counters[prefix + "p50_ms"] = row.p50;
  state.counters[prefix + "p99_ms"] = row.p99;
  state.counters[prefix + "max_ms"] = row.max;
  if (row.ratio > 0) state.counters[prefix + "ratio"] = row.ratio;
  table.push_back(row);
}

void report_quality(benchmark::State& state, const Errors& errors, double held) {
  state.counters["error_px"] = errors.rms_px();
  state.counters["held"] = held;
  state.counters["frames"] = static_cast<double>(errors.frames_with_result());
}

void BM_Oe(benchmark::State& state) {
  const auto height = static_cast<int>(state.range(0));
  const auto points = static_cast<int>(state.range(1));
  TurningCamera& camera = camera_of(height);
  const Calibration& calibration = camera.calibration();
  const double area = calibration.camera.width * calibration.camera.height;
  OeOptions options;
  options.max_width = calibration.camera.width;
  options.max_height = height;
  options.max_used = points;
  options.cell_size_px = std::sqrt(area / (2.5 * points));  // more in view than are used
  OeMode mode(options);
  mode.reset(calibration);
  Times process;
  Times maintain;
  Errors errors(camera);
  double held = 0;
  int k = 0;
  const auto next = [&](bool counted) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    FrameOrientation frame;
    const auto begin = Clock::now();
    const OeStatus status = mode.process(camera.view(k), camera.time_s(k), &telemetry, &frame);
    const double process_ms = milliseconds(begin);
    const auto begin_maintain = Clock::now();
    mode.maintain();
    const double maintain_ms = milliseconds(begin_maintain);
    if (counted) {
      process.add(process_ms);
      maintain.add(maintain_ms);
      held += mode.statistics().inliers;
      errors.add(k, [&](const Vector2<double>& u, Vector3<double>* d) {
        return status == OeStatus::kOk && frame.direction(u, d) == ProjectionStatus::kOk;
      });
    }
    ++k;
    return process_ms;
  };
  while (k < 2 * kFrames) (void)next(false);
  for (auto _ : state) state.SetIterationTime(1e-3 * next(true));
  held /= static_cast<double>(state.iterations());
  report(state, "oe", "process", process, errors.rms_px(), held);
  report(state, "oe", "maintain", maintain);
  report_quality(state, errors, held);
}

// As many of the best corners as asked for, spread over the picture.
std::vector<cv::Point2f> spread(std::vector<cv::KeyPoint>* corners, int count,
                                const cv::Size& size) {
  constexpr int kBorder = 12;
  const auto cell = static_cast<int>(std::sqrt(size.area() / (2.5 * count)));
  const int columns = size.width / cell + 1;
  std::vector<bool> taken(static_cast<std::size_t>(columns * (size.height / cell + 1)), false);
  std::sort(corners->begin(), corners->end(),
            [](const auto& a, const auto& b) { return a.response > b.response; });
  std::vector<cv::Point2f> points;
  for (const cv::KeyPoint& corner : *corners) {
    if (points.size() == static_cast<std::size_t>(count)) break;
    const cv::Point at = corner.pt;
    if (!cv::Rect(kBorder, kBorder, size.width - 2 * kBorder, size.height - 2 * kBorder)
             .contains(at)) {
      continue;
    }
    const auto index = static_cast<std::size_t>(at.y / cell * columns + at.x / cell);
    if (taken[index]) continue;
    taken[index] = true;
    points.push_back(corner.pt);
  }
  return points;
}

// R that takes camera to base best: Kabsch, reweighted five times with Huber's weights.
Matrix3<double> fit_rotation(const std::vector<Vector3<double>>& base,
                             const std::vector<Vector3<double>>& camera, double huber,
                             int* inliers) {
  Matrix3<double> R;
  std::vector<double> weight(base.size(), 1);
  for (int iteration = 0; iteration < 6; ++iteration) {
    Matrix3<double> sum = Matrix3<double>::Zero();
    for (std::size_t i = 0; i < base.size(); ++i) {
      sum += weight[i] * base[i] * camera[i].transpose();
    }
    const Eigen::JacobiSVD<Matrix3<double>> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector3<double> sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
    R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    *inliers = 0;
    for (std::size_t i = 0; i < base.size(); ++i) {
      const double error = (base[i] - R * camera[i]).norm();
      weight[i] = error <= huber ? 1 : huber / error;
      *inliers += static_cast<int>(error <= huber);
    }
  }
  return R;
}

void BM_LucasKanade(benchmark::State& state) {
  constexpr int kThreshold = 20;
  constexpr int kLevels = 3;
  constexpr double kHuberPx = 1;
  const cv::Size window(21, 21);
  const auto height = static_cast<int>(state.range(0));
  const auto points = static_cast<int>(state.range(1));
  TurningCamera& camera = camera_of(height);
  const Calibration& calibration = camera.calibration();
  Times total;
  Times fast;
  Times flow;
  Times fit;
  Errors errors(camera);
  double held = 0;
  int k = 0;
  std::vector<cv::KeyPoint> corners;
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  std::vector<uchar> found;
  std::vector<cv::Mat> pyramid_before;
  std::vector<cv::Mat> pyramid;
  std::vector<Vector3<double>> base;
  std::vector<Vector3<double>> seen;
  Matrix3<double> R_before = camera.R_base_from_camera(camera.middle_row_time_s(0));
  Vector3<double> w_before = Vector3<double>::Zero();  // rad/s, camera frame

  // Direction of a pixel in the camera as it stood at the middle row.
  const auto direction = [&](const cv::Point2f& at, const Vector3<double>& w) {
    const Vector2<double> u(at.x + 0.5, at.y + 0.5);
    Vector3<double> d;
    if (unproject(calibration.camera, u, &d) != ProjectionStatus::kOk) std::abort();
    const double time = (u.y() - 0.5 * height) * calibration.line_delay;
    return Vector3<double>((d + time * w.cross(d)).normalized());
  };
  const auto next = [&](bool counted) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    const auto begin = Clock::now();
    const Vector3<double> w =
        angular_velocity(calibration.mechanics, telemetry.angle, telemetry.rate);
    cv::buildOpticalFlowPyramid(camera.picture(k), pyramid, window, kLevels);
    Matrix3<double> R = R_before;
    int inliers = 0;
    double flow_ms = 0;
    double fit_ms = 0;
    if (!from.empty()) {
      cv::calcOpticalFlowPyrLK(pyramid_before, pyramid, from, to, found, cv::noArray(), window,
                               kLevels);
      flow_ms = milliseconds(begin);
      const auto begin_fit = Clock::now();
      base.clear();
      seen.clear();
      for (std::size_t i = 0; i < from.size(); ++i) {
        if (found[i] == 0) continue;
        base.emplace_back(R_before * direction(from[i], w_before));
        seen.push_back(direction(to[i], w));
      }
      R = fit_rotation(base, seen, kHuberPx / calibration.camera.focal_length, &inliers);
      fit_ms = milliseconds(begin_fit);
    }
    const auto begin_fast = Clock::now();
    cv::FAST(camera.picture(k), corners, kThreshold, true, cv::FastFeatureDetector::TYPE_9_16);
    from = spread(&corners, points, camera.picture(k).size());
    const double fast_ms = milliseconds(begin_fast);
    std::swap(pyramid, pyramid_before);
    R_before = R;
    w_before = w;
    const double total_ms = milliseconds(begin);
    if (counted) {
      total.add(total_ms);
      fast.add(fast_ms);
      flow.add(flow_ms);
      fit.add(fit_ms);
      held += inliers;
      errors.add(k, [&](const Vector2<double>& u, Vector3<double>* d) {
        *d = R *
             direction(
                 cv::Point2f(static_cast<float>(u.x() - 0.5), static_cast<float>(u.y() - 0.5)), w);
        return inliers > 0;
      });
    }
    ++k;
    return total_ms;
  };
  while (k < 10) (void)next(false);
  for (auto _ : state) state.SetIterationTime(1e-3 * next(true));
  held /= static_cast<double>(state.iterations());
  report(state, "lucas_kanade", "total", total, errors.rms_px(), held);
  report(state, "lucas_kanade", "flow", flow);
  report(state, "lucas_kanade", "fast", fast);
  report(state, "lucas_kanade", "fit", fit);
  report_quality(state, errors, held);
}

void BM_Orb(benchmark::State& state) {
  constexpr int kKeyFrames = 5;
  constexpr int kSpacing = kFrames / kKeyFrames;
  constexpr float kRatio = 0.8F;  // of the nearest neighbour's distance to the second's
  constexpr double kInlierPx = 3;
  const auto height = static_cast<int>(state.range(0));
  const auto points = static_cast<int>(state.range(1));
  TurningCamera& camera = camera_of(height);
  const auto orb = cv::ORB::create(points);
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  struct KeyFrame {
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
  };
  std::array<KeyFrame, kKeyFrames> map;
  for (int i = 0; i < kKeyFrames; ++i) {
    KeyFrame& key = map[static_cast<std::size_t>(i)];
    orb->detectAndCompute(camera.picture(i * kSpacing), cv::noArray(), key.points, key.descriptors);
  }
  Times total;
  Times features;
  Times matching;
  Times fit;
  Errors errors(camera);
  double held = 0;
  int k = 0;
  std::vector<cv::KeyPoint> corners;
  cv::Mat descriptors;
  std::vector<std::vector<cv::DMatch>> matches;
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  cv::Mat inliers;
  const auto next = [&](bool counted) {
    // The last one before this frame: never the frame itself, whose noise would be the same.
    const int key_index = (k + kFrames - 1) % kFrames / kSpacing;
    const KeyFrame& key = map[static_cast<std::size_t>(key_index)];
    const auto begin = Clock::now();
    orb->detectAndCompute(camera.picture(k), cv::noArray(), corners, descriptors);
    const double features_ms = milliseconds(begin);
    const auto begin_matching = Clock::now();
    matches.clear();  // knnMatch appends
    matcher.knnMatch(descriptors, key.descriptors, matches, 2);
    from.clear();
    to.clear();
    for (const auto& match : matches) {
      if (match.size() < 2 || match[0].distance > kRatio * match[1].distance) continue;
      from.push_back(corners[static_cast<std::size_t>(match[0].queryIdx)].pt);
      to.push_back(key.points[static_cast<std::size_t>(match[0].trainIdx)].pt);
    }
    const double matching_ms = milliseconds(begin_matching);
    const auto begin_fit = Clock::now();
    cv::Mat H;
    int held_now = 0;
    if (from.size() >= 4) {
      H = cv::findHomography(from, to, cv::RANSAC, kInlierPx, inliers);
      held_now = H.empty() ? 0 : cv::countNonZero(inliers);
    }
    const double fit_ms = milliseconds(begin_fit);
    const double total_ms = milliseconds(begin);
    if (counted) {
      total.add(total_ms);
      features.add(features_ms);
      matching.add(matching_ms);
      fit.add(fit_ms);
      held += held_now;
      errors.add(k, [&](const Vector2<double>& u, Vector3<double>* d) {
        if (H.empty()) return false;
        const cv::Matx33d matrix = H;
        const cv::Vec3d there = matrix * cv::Vec3d(u.x() - 0.5, u.y() - 0.5, 1);
        *d = camera.direction(key_index * kSpacing,
                              {there[0] / there[2] + 0.5, there[1] / there[2] + 0.5});
        return true;
      });
    }
    ++k;
    return total_ms;
  };
  while (k < 3) (void)next(false);
  for (auto _ : state) state.SetIterationTime(1e-3 * next(true));
  held /= static_cast<double>(state.iterations());
  report(state, "orb", "total", total, errors.rms_px(), held);
  report(state, "orb", "features", features);
  report(state, "orb", "matching", matching);
  report(state, "orb", "fit", fit);
  report_quality(state, errors, held);
}

void register_all() {
  const auto add = [](const char* name, void (*function)(benchmark::State&), int height, int points,
                      int iterations) {
    benchmark::RegisterBenchmark(name, function)
        ->Args({height, points})
        ->Iterations(iterations)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  // One size after the other: its pictures are made once. Each way runs right after the one that it is
  // compared with.
  for (const int height : {720, 1080, 2160}) {
    for (const int points : {50, 200, 800}) {
      add("oe", BM_Oe, height, points, 1000);
      add("lucas_kanade", BM_LucasKanade, height, points, height == 2160 ? 100 : 200);
      add("orb", BM_Orb, height, points, height == 2160 ? 40 : 100);
    }
  }
}

void print_table() {
  std::printf("\n%-6s %-7s %-13s %-9s %9s %9s %9s %7s %9s %7s\n", "lines", "points", "way", "part",
              "p50 ms", "p99 ms", "max ms", "ratio", "error px", "held");
  for (const Row& row : table) {
    std::printf("%-6d %-7d %-13s %-9s %9.3f %9.3f %9.3f", row.height, row.points, row.way.c_str(),
                row.part.c_str(), row.p50, row.p99, row.max);
    if (row.held > 0) {
      std::printf(" %7.1f %9.3f %7.1f", row.ratio, row.error_px, row.held);
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  alidade::benchmarks::register_all();
  benchmark::RunSpecifiedBenchmarks();
  alidade::benchmarks::print_table();
  benchmark::Shutdown();
  return 0;
}

// What a frame's orientation from the image costs, beside two ways to have it from OpenCV, on the same
// frames in the same run, one thread each, in turns of some frames so that all meet the same load:
//   oe            OeMode::process() with N landmarks, and maintain(), which may come later
//   stage         what process() is made of, by the same public functions, on the map that oe made
//   lucas_kanade  pyramidal Lucas-Kanade (21x21, 4 octaves, the last pyramid kept) on N corners of the
//                 frame before, rotation by Kabsch with Huber weights, FAST for the next N corners
//   orb           N ORB features matched by brute force to the N of the nearest of five key frames (the
//                 map), homography by RANSAC, after Lisanti, Masi, Pernici and Del Bimbo's mapping
// Lucas-Kanade is told the mount's rate, for the rolling shutter; a homography bends by itself, but ORB
// crowds its features where contrast is, and the corners of the image hang free.
// Times are those of the thread on its core: what other programs take does not count. ratio: median over
// the median of process(). error: of the turn from one frame to the next against truth, RMS over
// frames, over centre and corners and over u and v; held: landmarks that hold a frame's answer, on
// average. p99 of fewer than 100 frames is their largest. A table of all is printed at the end.

#include <benchmark/benchmark.h>

#include <time.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/model/lens/camera.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "test/benchmark/oe_stages.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {
namespace {

constexpr int kFrames = 40;

// ms that this thread has been on a core.
double now_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

template <class Work>
double milliseconds(Work&& work) {
  const double begin = now_ms();
  work();
  return now_ms() - begin;
}

// Only the images of one size are held at a time.
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

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::lround(q * static_cast<double>(values.size() - 1)))];
}

// One way to an orientation, frame after frame, and what it cost.
class Way {
 public:
  Way(std::string name, TurningCamera* camera)
      : camera_(*camera), errors_(*camera), name_(std::move(name)) {}
  virtual ~Way() = default;
  Way(const Way&) = delete;
  Way& operator=(const Way&) = delete;

  void run(int frames, bool counted) {
    counted_ = counted;
    for (int i = 0; i < frames; ++i) process(frame_++);
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  using Part = std::pair<std::string, std::vector<double>>;  // ms of each frame
  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  [[nodiscard]] double error_px() const { return errors_.rms_px(); }
  [[nodiscard]] double answered() const {
    return static_cast<double>(errors_.frames_with_result()) /
           static_cast<double>(parts_[0].second.size());
  }
  [[nodiscard]] double held() const { return held_ / static_cast<double>(parts_[0].second.size()); }

 protected:
  virtual void process(int k) = 0;

  void record(const char* part, double ms) {
    if (!counted_) return;
    auto at =
        std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.first == part; });
    if (at == parts_.end()) at = parts_.insert(at, {part, {}});
    at->second.push_back(ms);
  }
  void record_answer(int k, int held, const Errors::Direction& direction) {
    if (!counted_) return;
    held_ += held;
    errors_.add(k, direction);
  }

  TurningCamera& camera_;

 private:
  Errors errors_;
  std::string name_;
  std::vector<Part> parts_;
  double held_ = 0;
  int frame_ = 0;
  bool counted_ = false;
};

class Oe : public Way {
 public:
  Oe(TurningCamera* camera, int points)
      : Way("oe", camera), mode_(measured_options(camera->calibration().camera, points)) {
    mode_.reset(camera->calibration());
  }
  [[nodiscard]] const OeMode& mode() const { return mode_; }

 private:
  void process(int k) override {
    const InterpolatedPanTilt telemetry = camera_.telemetry(k);
    FrameOrientation frame;
    OeStatus status = OeStatus::kNotFinite;
    record("process", milliseconds([&] {
             status = mode_.process(camera_.view(k), camera_.time_s(k), &telemetry, &frame);
           }));
    record("maintain", milliseconds([&] { mode_.maintain(); }));
    record_answer(k, mode_.statistics().inliers, [&](const Vector2<double>& u, Vector3<double>* d) {
      return status == OeStatus::kOk && frame.direction(u, d) == ProjectionStatus::kOk;
    });
  }

  OeMode mode_;
};

class Stages : public Way {
 public:
  Stages(TurningCamera* camera, const OeMode* mode, int points)
      : Way("stage", camera),
        stages_(camera->calibration(), mode, points,
                [this](const char* part, const std::function<void()>& work) {
                  record(part, milliseconds(work));
                }) {}

 private:
  void process(int k) override {
    const int inliers = stages_.run(camera_.view(k), camera_.telemetry(k));
    record_answer(k, inliers, [](const Vector2<double>&, Vector3<double>*) { return false; });
  }

  OeStages stages_;
};

// As many of the best corners as asked for, spread over the image.
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

class LucasKanade : public Way {
 public:
  LucasKanade(TurningCamera* camera, int points)
      : Way("lucas_kanade", camera),
        points_(points),
        R_(camera->R_base_from_camera(camera->middle_row_time_s(0))) {}

 private:
  static constexpr int kThreshold = 20;
  static constexpr int kLevels = 3;
  static constexpr double kHuberPx = 1;

  void process(int k) override {
    const Calibration& calibration = camera_.calibration();
    const cv::Size window(21, 21);
    const InterpolatedPanTilt telemetry = camera_.telemetry(k);
    const cv::Mat& image = camera_.image(k);
    const Vector3<double> w =
        angular_velocity(calibration.mechanics, telemetry.angle, telemetry.rate);
    const double flow_ms = milliseconds([&] {
      cv::buildOpticalFlowPyramid(image, pyramid_, window, kLevels);
      if (from_.empty()) return;
      cv::calcOpticalFlowPyrLK(pyramid_before_, pyramid_, from_, to_, found_, cv::noArray(), window,
                               kLevels);
    });
    int inliers = 0;
    const double fit_ms = milliseconds([&] {
      if (from_.empty()) return;
      base_.clear();
      seen_.clear();
      for (std::size_t i = 0; i < from_.size(); ++i) {
        if (found_[i] == 0) continue;
        base_.emplace_back(R_ * direction(from_[i], w_));
        seen_.push_back(direction(to_[i], w));
      }
      R_ = fit_rotation(base_, seen_, kHuberPx / calibration.camera.focal_length, &inliers);
    });
    const double fast_ms = milliseconds([&] {
      cv::FAST(image, corners_, kThreshold, true, cv::FastFeatureDetector::TYPE_9_16);
      from_ = spread(&corners_, points_, image.size());
    });
    std::swap(pyramid_, pyramid_before_);
    w_ = w;
    record("total", flow_ms + fit_ms + fast_ms);
    record("flow", flow_ms);
    record("fit", fit_ms);
    record("fast", fast_ms);
    record_answer(k, inliers, [&](const Vector2<double>& u, Vector3<double>* d) {
      *d = R_ * direction({static_cast<float>(u.x() - 0.5), static_cast<float>(u.y() - 0.5)}, w);
      return inliers > 0;
    });
  }

  // Of a pixel, in the camera as it stood at the middle row.
  [[nodiscard]] Vector3<double> direction(const cv::Point2f& at, const Vector3<double>& w) const {
    const Calibration& calibration = camera_.calibration();
    const Vector2<double> u(at.x + 0.5, at.y + 0.5);
    Vector3<double> d;
    if (unproject(calibration.camera, u, &d) != ProjectionStatus::kOk) std::abort();
    const double time = (u.y() - 0.5 * calibration.camera.height) * calibration.line_delay;
    return (d + time * w.cross(d)).normalized();
  }

  int points_;
  Matrix3<double> R_;
  Vector3<double> w_ = Vector3<double>::Zero();  // rad/s, camera frame
  std::vector<cv::KeyPoint> corners_;
  std::vector<cv::Point2f> from_, to_;
  std::vector<uchar> found_;
  std::vector<cv::Mat> pyramid_before_, pyramid_;
  std::vector<Vector3<double>> base_, seen_;
};

class Orb : public Way {
 public:
  Orb(TurningCamera* camera, int points) : Way("orb", camera), orb_(cv::ORB::create(points)) {
    for (std::size_t i = 0; i < map_.size(); ++i) {
      orb_->detectAndCompute(camera->image(static_cast<int>(i) * kSpacing), cv::noArray(),
                             map_[i].points, map_[i].descriptors);
    }
  }

 private:
  static constexpr int kKeyFrames = 5;
  static constexpr int kSpacing = kFrames / kKeyFrames;
  static constexpr float kRatio = 0.8F;  // of the nearest neighbour's distance to the second's
  static constexpr double kInlierPx = 3;

  struct KeyFrame {
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
  };

  void process(int k) override {
    // The last one before this frame: never the frame itself, whose noise would be the same.
    const int key_index = (k + kFrames - 1) % kFrames / kSpacing;
    const KeyFrame& key = map_[static_cast<std::size_t>(key_index)];
    const double features_ms = milliseconds(
        [&] { orb_->detectAndCompute(camera_.image(k), cv::noArray(), corners_, descriptors_); });
    const double matching_ms = milliseconds([&] {
      matches_.clear();  // knnMatch appends
      matcher_.knnMatch(descriptors_, key.descriptors, matches_, 2);
      from_.clear();
      to_.clear();
      for (const auto& match : matches_) {
        if (match.size() < 2 || match[0].distance > kRatio * match[1].distance) continue;
        from_.push_back(corners_[static_cast<std::size_t>(match[0].queryIdx)].pt);
        to_.push_back(key.points[static_cast<std::size_t>(match[0].trainIdx)].pt);
      }
    });
    cv::Mat H;
    int inliers = 0;
    const double fit_ms = milliseconds([&] {
      if (from_.size() < 4) return;
      H = cv::findHomography(from_, to_, cv::RANSAC, kInlierPx, mask_);
      if (!H.empty()) inliers = cv::countNonZero(mask_);
    });
    record("total", features_ms + matching_ms + fit_ms);
    record("features", features_ms);
    record("matching", matching_ms);
    record("fit", fit_ms);
    record_answer(k, inliers, [&](const Vector2<double>& u, Vector3<double>* d) {
      if (H.empty()) return false;
      const cv::Vec3d there = cv::Matx33d(H) * cv::Vec3d(u.x() - 0.5, u.y() - 0.5, 1);
      *d = camera_.direction(key_index * kSpacing,
                             {there[0] / there[2] + 0.5, there[1] / there[2] + 0.5});
      return true;
    });
  }

  cv::Ptr<cv::ORB> orb_;
  cv::BFMatcher matcher_{cv::NORM_HAMMING};
  std::array<KeyFrame, kKeyFrames> map_;
  std::vector<cv::KeyPoint> corners_;
  cv::Mat descriptors_, mask_;
  std::vector<std::vector<cv::DMatch>> matches_;
  std::vector<cv::Point2f> from_, to_;
};

std::vector<std::string> table;

template <class... Values>
void add_line(const char* format, Values... values) {
  char line[160];
  std::snprintf(line, sizeof(line), format, values...);
  table.emplace_back(line);
}

// To the JSON and to the table.
void report(benchmark::State& state, const Way& way, double reference_ms) {
  for (const auto& [part, ms] : way.parts()) {
    const double p50 = quantile(ms, 0.5);
    const double p99 = quantile(ms, 0.99);
    const double max = quantile(ms, 1);
    const std::string name = way.name() + "_" + part;
    state.counters[name + "_p50_ms"] = p50;
    state.counters[name + "_p99_ms"] = p99;
    state.counters[name + "_max_ms"] = max;
    const bool whole = &ms == &way.parts()[0].second && way.name() != "stage";
    add_line("%5d %7d  %-13s %-9s %8.3f %8.3f %8.3f", static_cast<int>(state.range(0)),
             static_cast<int>(state.range(1)), way.name().c_str(), part.c_str(), p50, p99, max);
    if (!whole) continue;
    state.counters[way.name() + "_ratio"] = p50 / reference_ms;
    state.counters[way.name() + "_error_px"] = way.error_px();
    state.counters[way.name() + "_held"] = way.held();
    state.counters[way.name() + "_answered"] = way.answered();
    char rest[80];
    std::snprintf(rest, sizeof(rest), " %7.1f %9.3f %7.1f %8.0f %%", p50 / reference_ms,
                  way.error_px(), way.held(), 100 * way.answered());
    table.back() += rest;
  }
}

// An iteration is a turn of every way. The time that Google Benchmark shows is process()'s.
void BM_Frames(benchmark::State& state) {
  const auto height = static_cast<int>(state.range(0));
  const auto points = static_cast<int>(state.range(1));
  TurningCamera& camera = camera_of(height);
  Oe oe(&camera, points);
  LucasKanade lucas_kanade(&camera, points);
  Orb orb(&camera, points);
  oe.run(2 * kFrames, false);  // the map is made
  lucas_kanade.run(3, false);
  orb.run(3, false);
  Stages stages(&camera, &oe.mode(), points);
  const bool large = height > 1080;
  for (auto _ : state) {
    const int frames = large ? 30 : 60;
    oe.run(frames, true);
    stages.run(10, true);
    lucas_kanade.run(large ? 5 : 10, true);
    orb.run(large ? 2 : 4, true);
    const auto& ms = oe.parts()[0].second;
    double sum = 0;
    for (auto at = ms.end() - frames; at != ms.end(); ++at) sum += *at;
    state.SetIterationTime(1e-3 * sum);
  }
  const double reference_ms = quantile(oe.parts()[0].second, 0.5);
  report(state, oe, reference_ms);
  report(state, stages, reference_ms);
  report(state, lucas_kanade, reference_ms);
  report(state, orb, reference_ms);
}

void configurations(benchmark::internal::Benchmark* benchmark) {
  for (const int height : {720, 1080, 2160}) {
    for (const int points : {50, 200, 800}) benchmark->Args({height, points});
  }
}

BENCHMARK(BM_Frames)
    ->Apply(configurations)
    ->ArgNames({"lines", "points"})
    ->Iterations(20)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

void print_table() {
  std::printf("\n%5s %7s  %-13s %-9s %8s %8s %8s %7s %9s %7s %10s\n", "lines", "points", "way",
              "part", "p50 ms", "p99 ms", "max ms", "ratio", "error px", "held", "answered");
  for (const std::string& line : table) std::printf("%s\n", line.c_str());
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  alidade::benchmarks::print_table();
  benchmark::Shutdown();
  return 0;
}

// What looking at an image costs, beside OpenCV's way on the same image in the same run, one thread
// each: the pyramid beside buildPyramid and INTER_AREA, corners in cells beside FAST with non-maximum
// suppression, the alignment of 200 patches beside pyramidal Lucas-Kanade on the same 200 points. Times are
// for one image, or for all points. Statistics are over repetitions: median and p99 of their means.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade {
namespace {

constexpr int kOctaves = 4;
constexpr int kCell = 64;
constexpr int kThreshold = 20;
constexpr std::size_t kPoints = 200;
constexpr double kShiftU = 0.4;  // px
constexpr double kShiftV = 0.3;

ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

// A photo at the size of a frame, moved, with noise of 2 grey levels.
cv::Mat frame(int height, double shift_u, double shift_v) {
  const cv::Mat photo = cv::imread(
      std::string(ALIDADE_TEST_DATA) + "/aitzgorri_by_Aitzol_Berasategi.jpg", cv::IMREAD_GRAYSCALE);
  if (photo.empty()) std::abort();
  const int width = height * 16 / 9;
  const double scale = static_cast<double>(width) / photo.cols;
  const cv::Matx23d warp(scale, 0, shift_u, 0, scale, shift_v);
  cv::Mat image;
  cv::warpAffine(photo, image, warp, {width, height}, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  std::mt19937_64 random(1 + static_cast<unsigned>(shift_u * 100));
  std::normal_distribution<double> noise(0, 2);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      auto& pixel = image.at<uchar>(v, u);
      pixel = cv::saturate_cast<uchar>(pixel + noise(random));
    }
  }
  return image;
}

void BM_Pyramid(benchmark::State& state) {
  const cv::Mat image = frame(static_cast<int>(state.range(0)), 0, 0);
  Pyramid pyramid(image.cols, image.rows, kOctaves);
  for (auto _ : state) {
    benchmark::DoNotOptimize(pyramid.build(view_of(image), kOctaves));
    benchmark::ClobberMemory();
  }
}

void BM_OpenCvPyramid(benchmark::State& state) {
  const cv::Mat image = frame(static_cast<int>(state.range(0)), 0, 0);
  std::vector<cv::Mat> pyramid;
  for (auto _ : state) {
    cv::buildPyramid(image, pyramid, kOctaves - 1);
    benchmark::ClobberMemory();
  }
}

void BM_OpenCvResizeArea(benchmark::State& state) {
  const cv::Mat image = frame(static_cast<int>(state.range(0)), 0, 0);
  std::vector<cv::Mat> pyramid(kOctaves);
  pyramid[0] = image;
  for (auto _ : state) {
    for (std::size_t l = 1; l < kOctaves; ++l) {
      const cv::Size half(pyramid[l - 1].cols / 2, pyramid[l - 1].rows / 2);
      cv::resize(pyramid[l - 1], pyramid[l], half, 0, 0, cv::INTER_AREA);
    }
    benchmark::ClobberMemory();
  }
}

void BM_FastGrid(benchmark::State& state) {
  const cv::Mat image = frame(static_cast<int>(state.range(0)), 0, 0);
  FastGrid grid(image.cols, image.rows, kCell);
  std::vector<FastCorner> corners(static_cast<std::size_t>(grid.max_cells()));
  FastResult result;
  for (auto _ : state) {
    result = grid.detect(view_of(image), kThreshold, corners.data(), grid.max_cells());
    benchmark::ClobberMemory();
  }
  state.counters["corners"] = result.count;
}

void BM_OpenCvFast(benchmark::State& state) {
  const cv::Mat image = frame(static_cast<int>(state.range(0)), 0, 0);
  std::vector<cv::KeyPoint> corners;
  for (auto _ : state) {
    cv::FAST(image, corners, kThreshold, true, cv::FastFeatureDetector::TYPE_9_16);
    benchmark::ClobberMemory();
  }
  state.counters["corners"] = static_cast<double>(corners.size());
}

std::vector<Vector2<double>> points_of(const cv::Mat& image) {
  FastGrid grid(image.cols, image.rows, kCell);
  std::vector<FastCorner> corners(static_cast<std::size_t>(grid.max_cells()));
  const FastResult result =
      grid.detect(view_of(image), kThreshold, corners.data(), grid.max_cells());
  std::vector<Vector2<double>> points;
  ReferencePatch reference;
  for (int i = 0; i < result.count && points.size() < kPoints; ++i) {
    const FastCorner& corner = corners[static_cast<std::size_t>(i)];
    const Vector2<double> point(corner.u + 0.5, corner.v + 0.5);
    if (std::min({point.x(), point.y(), image.cols - point.x(), image.rows - point.y()}) > 20 &&
        prepare(view_of(image), point, Matrix2<double>::Identity(), 4, &reference) ==
            PrepareStatus::kOk) {
      points.push_back(point);
    }
  }
  if (points.size() != kPoints) std::abort();
  return points;
}

double rms(const std::vector<double>& squares) {
  double sum = 0;
  for (const double square : squares) sum += square;
  return std::sqrt(sum / (2 * static_cast<double>(squares.size())));
}

void prepare_patches(benchmark::State& state, const Matrix2<double>& A) {
  const cv::Mat image = frame(1080, 0, 0);
  const auto points = points_of(image);
  ReferencePatch reference;
  for (auto _ : state) {
    for (const auto& point : points) {
      benchmark::DoNotOptimize(prepare(view_of(image), point, A, 4, &reference));
      benchmark::DoNotOptimize(reference);
    }
  }
}

void BM_Prepare200Patches(benchmark::State& state) {
  prepare_patches(state, Matrix2<double>::Identity());
}

void BM_Prepare200WarpedPatches(benchmark::State& state) {
  Matrix2<double> shear = Matrix2<double>::Identity();
  shear(0, 1) = 0.03;
  prepare_patches(state, shear);
}

void BM_Align200Patches(benchmark::State& state) {
  const cv::Mat before = frame(1080, 0, 0);
  const cv::Mat after = frame(1080, kShiftU, kShiftV);
  const auto points = points_of(before);
  std::vector<ReferencePatch> references(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_usable(
            prepare(view_of(before), points[i], Matrix2<double>::Identity(), 4, &references[i]))) {
      std::abort();
    }
  }
  std::vector<Alignment> alignments(points.size());
  std::vector<AlignmentStatus> status(points.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      status[i] = align(references[i], view_of(after), points[i], {}, &alignments[i]);
    }
    benchmark::ClobberMemory();
  }
  std::vector<double> squares;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (status[i] != AlignmentStatus::kConverged) continue;
    squares.push_back(
        (alignments[i].position - points[i] - Vector2<double>(kShiftU, kShiftV)).squaredNorm());
  }
  state.counters["found"] = static_cast<double>(squares.size());
  state.counters["rms_px"] = rms(squares);
}

// Its pyramids are made within, as every frame needs one of them; the window is OpenCV's default.
void BM_OpenCvLucasKanade200Points(benchmark::State& state) {
  const cv::Mat before = frame(1080, 0, 0);
  const cv::Mat after = frame(1080, kShiftU, kShiftV);
  std::vector<cv::Point2f> from;
  for (const auto& point : points_of(before)) {
    from.emplace_back(static_cast<float>(point.x() - 0.5), static_cast<float>(point.y() - 0.5));
  }
  const cv::Size window(21, 21);
  const auto levels = static_cast<int>(state.range(0));
  std::vector<cv::Mat> pyramid_before;
  cv::buildOpticalFlowPyramid(before, pyramid_before, window, levels);
  std::vector<cv::Mat> pyramid_after;
  std::vector<cv::Point2f> to;
  std::vector<uchar> found;
  for (auto _ : state) {
    cv::buildOpticalFlowPyramid(after, pyramid_after, window, levels);
    cv::calcOpticalFlowPyrLK(pyramid_before, pyramid_after, from, to, found, cv::noArray(), window,
                             levels);
    benchmark::ClobberMemory();
  }
  std::vector<double> squares;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (found[i] == 0) continue;
    const double du = to[i].x - from[i].x - kShiftU;
    const double dv = to[i].y - from[i].y - kShiftV;
    squares.push_back(du * du + dv * dv);
  }
  state.counters["found"] = static_cast<double>(squares.size());
  state.counters["rms_px"] = rms(squares);
}

double p99(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(0.99 * static_cast<double>(sorted.size() - 1))];
}

void repeat(benchmark::internal::Benchmark* benchmark) {
  benchmark->Repetitions(20)->MinTime(0.01)->ReportAggregatesOnly()->ComputeStatistics("p99", p99);
}

void both_sizes(benchmark::internal::Benchmark* benchmark) {
  repeat(benchmark->Unit(benchmark::kMicrosecond)->Arg(1080)->Arg(2160));
}

void points(benchmark::internal::Benchmark* benchmark) {
  repeat(benchmark->Unit(benchmark::kMicrosecond));
}

BENCHMARK(BM_Pyramid)->Apply(both_sizes);
BENCHMARK(BM_OpenCvPyramid)->Apply(both_sizes);
BENCHMARK(BM_OpenCvResizeArea)->Apply(both_sizes);
BENCHMARK(BM_FastGrid)->Apply(both_sizes);
BENCHMARK(BM_OpenCvFast)->Apply(both_sizes);
BENCHMARK(BM_Prepare200Patches)->Apply(points);
BENCHMARK(BM_Prepare200WarpedPatches)->Apply(points);
BENCHMARK(BM_Align200Patches)->Apply(points);
BENCHMARK(BM_OpenCvLucasKanade200Points)->Arg(0)->Arg(3)->Apply(points);

}  // namespace
}  // namespace alidade

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

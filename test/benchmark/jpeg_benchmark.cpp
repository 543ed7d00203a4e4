// What a JPEG image to its luma plane costs, beside libjpeg-turbo called plainly: one handle and one plane for all
// images, no check of the header. In turns, image by image; ratio_to_turbojpeg is the median of the ratios.

#include <benchmark/benchmark.h>
#include <turbojpeg.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

#include "platform/video/jpeg_decoder.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {
namespace {

using Clock = std::chrono::steady_clock;

double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void BM_JpegToLuma(benchmark::State& state) {
  const TurningCamera camera(static_cast<int>(state.range(0)), 1);
  const cv::Mat& image = camera.image(0);
  const std::vector<std::uint8_t> jpeg = jpeg_of(image);
  const std::string_view bytes(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
  JpegDecoder decoder;
  Picture decoded;
  const tjhandle plain = tjInitDecompress();
  std::vector<std::uint8_t> luma(image.total());
  std::vector<double> ratios;
  for (auto _ : state) {
    const Clock::time_point begin = Clock::now();
    if (tjDecompress2(plain, jpeg.data(), jpeg.size(), luma.data(), image.cols, 0, image.rows,
                      TJPF_GRAY, 0) != 0) {
      std::abort();
    }
    const Clock::time_point middle = Clock::now();
    if (!decoder.decode(bytes, &decoded)) std::abort();
    const Clock::time_point end = Clock::now();
    state.SetIterationTime(seconds(end - middle));
    ratios.push_back(seconds(end - middle) / seconds(middle - begin));
  }
  if (!std::equal(luma.begin(), luma.end(), decoded.luma)) std::abort();
  tjDestroy(plain);
  state.counters["ratio_to_turbojpeg"] = median(ratios);
}

BENCHMARK(BM_JpegToLuma)
    ->Unit(benchmark::kMillisecond)
    ->Arg(720)
    ->Arg(1080)
    ->Arg(2160)
    ->Iterations(100)
    ->UseManualTime();

}  // namespace
}  // namespace alidade::benchmarks

BENCHMARK_MAIN();

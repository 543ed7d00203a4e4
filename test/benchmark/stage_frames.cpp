// Writes what stage_cost works on: the frames of oe_benchmark, and one of them as a JPEG image.
// Usage: stage_frames FOLDER

#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "test/benchmark/recorded_frames.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {
namespace {

constexpr int kFrames = 40;  // a round of the camera

RecordedFrames recorded(TurningCamera* camera) {
  RecordedFrames out;
  out.calibration = camera->calibration();
  for (int k = 0; k < camera->frames(); ++k) {
    const cv::Mat& image = camera->image(k);
    out.frames.push_back({camera->time_s(k),
                          camera->telemetry(k),
                          {image.begin<std::uint8_t>(), image.end<std::uint8_t>()}});
  }
  return out;
}

bool write_jpeg(const cv::Mat& image, const std::string& name) {
  const std::vector<std::uint8_t> jpeg = jpeg_of(image);
  std::ofstream file(name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
  return static_cast<bool>(file.flush());
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade::benchmarks;
  if (argc != 2) {
    std::fprintf(stderr, "usage: stage_frames FOLDER\n");
    return 2;
  }
  cv::setNumThreads(1);
  const std::string folder = argv[1];
  for (const int height : {720, 1080}) {
    const std::string size = std::to_string(height);
    TurningCamera camera(height, kFrames);
    if (!write_frames(recorded(&camera), folder + "/frames-" + size) ||
        !write_jpeg(camera.image(0), folder + "/picture-" + size + ".jpg")) {
      std::fprintf(
          stderr,
          "%s: cannot write the frames of %d lines there; name a folder with 200 MB of room\n",
          argv[1], height);
      return 1;
    }
  }
  return 0;
}

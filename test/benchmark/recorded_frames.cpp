#include "test/benchmark/recorded_frames.h"

#include <array>
#include <cstddef>
#include <fstream>

namespace alidade::benchmarks {
namespace {

constexpr std::int64_t kMagic = 0x31454D4152464C41;  // ALFRAME1

using Numbers = std::array<double, 11>;

Numbers numbers_of(const RecordedFrame& frame) {
  const InterpolatedPanTilt& t = frame.telemetry;
  return {frame.time_s,
          t.angle.pan,
          t.angle.tilt,
          t.rate.pan,
          t.rate.tilt,
          t.covariance(0, 0),
          t.covariance(1, 1),
          t.covariance(2, 2),
          t.covariance(3, 3),
          t.acceleration_square.x(),
          t.acceleration_square.y()};
}

void set(const Numbers& n, RecordedFrame* frame) {
  constexpr int kSamples = 8;  // a cubic's
  frame->time_s = n[0];
  InterpolatedPanTilt& t = frame->telemetry;
  t.angle = {n[1], n[2]};
  t.rate = {n[3], n[4]};
  t.covariance.diagonal() << n[5], n[6], n[7], n[8];
  t.acceleration_square = {n[9], n[10]};
  t.samples = kSamples;
}

template <class T>
void put(const T& value, std::ofstream* file) {
  file->write(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
bool get(std::ifstream* file, T* value) {
  return static_cast<bool>(file->read(reinterpret_cast<char*>(value), sizeof *value));
}

}  // namespace

ImageView RecordedFrames::view(std::size_t k) const {
  const Camera<double>& camera = calibration.camera;
  return {frames[k].luma.data(), camera.width, camera.height, camera.width};
}

bool write_frames(const RecordedFrames& frames, const std::string& name) {
  std::ofstream file(name, std::ios::binary);
  const Camera<double>& camera = frames.calibration.camera;
  put(kMagic, &file);
  put(camera.width, &file);
  put(camera.height, &file);
  put(camera.focal_length, &file);
  put(frames.calibration.line_delay, &file);
  put(static_cast<std::int32_t>(frames.frames.size()), &file);
  for (const RecordedFrame& frame : frames.frames) {
    put(numbers_of(frame), &file);
    file.write(reinterpret_cast<const char*>(frame.luma.data()),
               static_cast<std::streamsize>(frame.luma.size()));
  }
  return static_cast<bool>(file.flush());
}

bool read_frames(const std::string& name, RecordedFrames* frames) {
  std::ifstream file(name, std::ios::binary);
  Camera<double>& camera = frames->calibration.camera;
  std::int64_t magic = 0;
  std::int32_t count = 0;
  if (!get(&file, &magic) || magic != kMagic || !get(&file, &camera.width) ||
      !get(&file, &camera.height) || !get(&file, &camera.focal_length) ||
      !get(&file, &frames->calibration.line_delay) || !get(&file, &count) || count < 0)
    return false;
  frames->frames.assign(static_cast<std::size_t>(count), {});
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  for (RecordedFrame& frame : frames->frames) {
    Numbers numbers{};
    frame.luma.resize(pixels);
    if (!get(&file, &numbers) || !file.read(reinterpret_cast<char*>(frame.luma.data()),
                                            static_cast<std::streamsize>(pixels)))
      return false;
    set(numbers, &frame);
  }
  return true;
}

}  // namespace alidade::benchmarks

#include "test/accuracy/pattern_calibration.h"

#include <cstddef>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <system_error>

#include "edge_app/commands/pattern_video.h"
#include "test/accuracy/pattern_detections.h"
#include "test/simulator/recording_writer.h"

namespace alidade::test {
namespace {

namespace fs = std::filesystem;

struct Readout {
  double line_delay_s, rate_hz;
};
constexpr Readout kReadouts[] = {{51.56e-6, 20}, {82.5e-6, 12}, {-60e-6, 20}, {27e-6, 25}, {0, 20}};
constexpr double kExposures_s[] = {2e-3, 8e-3, 16e-3, 4e-3};
constexpr double kNoises[] = {1, 2, 3};
constexpr double kReaches[] = {1, 1.6, 1.3};
constexpr std::size_t kPatterns[] = {0, 1, 3};  // of patterns_under_test()

// The folder goes with it, however the recording ends.
struct RemovedFolder {
  const fs::path& folder;
  ~RemovedFolder() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
};

template <class T, std::size_t kCount>
const T& by_turns(const T (&all)[kCount], int number) {
  return all[static_cast<std::size_t>(number) % kCount];
}

double process_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

PatternRecording pattern_recording(int number) {
  const PatternUnderTest& pattern = patterns_under_test()[by_turns(kPatterns, number)];
  const Readout& readout = by_turns(kReadouts, number);
  PatternRecording recording;
  recording.pattern = pattern.name;
  simulator::Config& config = recording.config;
  config = pattern_scene(pattern);
  config.seed = static_cast<std::uint64_t>(1000 + number);
  config.duration = 30;
  config.image.rate_hz = readout.rate_hz;
  config.camera.line_delay = readout.line_delay_s;
  config.sensor.exposure = by_turns(kExposures_s, number);
  config.sensor.read_noise = by_turns(kNoises, number / 4);
  config.pattern->hand.reach = by_turns(kReaches, number / 2);
  config.pattern->finger = 0.03;
  config.timing.frame_loss = 0.05;
  config.timing.image.sigma = 1e-3;
  char text[160];
  std::snprintf(text, sizeof text, "%d: %s, %.4g us at %.4g Hz, %.0f ms, noise %.0f", number,
                recording.pattern.c_str(), 1e6 * readout.line_delay_s, readout.rate_hz,
                1e3 * config.sensor.exposure, config.sensor.read_noise);
  recording.name = text;
  return recording;
}

LensVector lens_truth(const simulator::Config& config) {
  const simulator::PatternConfig::Lens& lens = config.pattern->lens;
  LensVector truth;
  truth << lens.focal_length_u, lens.focal_length_v, lens.centre_u, lens.centre_v, lens.k1, lens.k2,
      lens.p1, lens.p2, config.camera.line_delay;
  return truth;
}

PatternOutcome calibrate_pattern_recording(const PatternRecording& recording,
                                           const fs::path& folder) {
  const RemovedFolder removed{folder};
  simulator::write_recording(recording.config, folder);
  std::string error;
  const std::optional<KnownPattern> pattern = parse_pattern(recording.pattern, &error);
  PatternOutcome outcome;
  const double start_s = process_cpu_s();
  const PatternVideo video =
      find_pattern((folder / "video.mkv").string(), pattern.value(), [](int, int) { return true; });
  const double found_s = process_cpu_s();
  outcome.calibration = calibrate_pattern(video.data);
  outcome.detection_cpu_s = found_s - start_s;
  outcome.adjustment_cpu_s = process_cpu_s() - found_s;
  outcome.images = video.images;
  outcome.found = video.found;
  return outcome;
}

}  // namespace alidade::test

#include "test/accuracy/pattern_runs.h"

#include <ctime>

#include "test/accuracy/pattern_bound.h"

namespace alidade::test {
namespace {

// Of the bound's motion: enough for the hand's, and no more than the frames can carry.
constexpr double kKnotsPerSecond = 8;

double cpu_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

std::vector<PatternSetting> pattern_settings() {
  constexpr double kPixelsPerLine = 1650;  // Oth, section 5.2, blanking included
  std::vector<PatternSetting> settings;
  for (const auto& [clock_mhz, rate_hz] :
       {std::pair{12.0, 7.0}, {20.0, 12.0}, {32.0, 19.0}, {40.0, 23.0}}) {
    PatternSetting setting;
    setting.pixel_clock_mhz = clock_mhz;
    setting.scene.lens.line_delay_s = kPixelsPerLine / clock_mhz * 1e-6;
    setting.scene.rate_hz = rate_hz;
    setting.name = std::to_string(static_cast<int>(clock_mhz)) + " MHz";
    settings.push_back(setting);
  }
  PatternSetting full_hd;
  full_hd.name = "1080p30";
  full_hd.scene.width = 1920;
  full_hd.scene.height = 1080;
  full_hd.scene.lens = {1500, 1504, 972, 531, -0.28, 0.08, 3e-4, -2e-4, 27e-6};
  full_hd.scene.rate_hz = 30;
  settings.push_back(full_hd);
  PatternSetting from_below;
  from_below.name = "-60 us";
  from_below.scene.lens.line_delay_s = -60e-6;
  settings.push_back(from_below);
  return settings;
}

PatternRun run_pattern(const PatternScene& scene, bool bounded) {
  const PatternData data = simulate_pattern(scene);
  const double begin = cpu_time_s();
  const PatternCalibration calibration = calibrate_pattern(data);
  PatternRun run;
  run.cpu_s = cpu_time_s() - begin;
  run.status = calibration.status;
  run.message = calibration.message;
  run.error = calibration.lens - truth_of(scene.lens);
  run.line_delay_s = calibration.lens[index(LensParameter::kLineDelay)];
  run.covariance = calibration.covariance;
  run.knots_per_frame =
      static_cast<double>(calibration.curve.segments()) / static_cast<double>(data.frames.size());
  if (bounded) run.bound = pattern_bound(scene, data, kKnotsPerSecond);
  return run;
}

double squared_distance(const LensVector& error, const LensMatrix& covariance,
                        const LensGroup& group) {
  const Eigen::VectorXd e = error.segment(group.first, group.size);
  const Eigen::MatrixXd C = covariance.block(group.first, group.first, group.size, group.size);
  return e.dot(C.ldlt().solve(e));
}

}  // namespace alidade::test

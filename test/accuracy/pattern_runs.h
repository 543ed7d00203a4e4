#pragma once
// One recording of a known pattern before a simulated camera, calibrated, beside its truth and the best that is possible.

#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"
#include "test/core/pattern/pattern_simulation.h"

namespace alidade::test {

struct PatternSetting {
  std::string name;
  PatternScene scene;
  double pixel_clock_mhz = 0;  // of the paper's camera; 0: another camera
};

// What is asked of the estimator: the paper's four pixel clocks at as many frames a second as they allow, a camera of 1080
// lines, one that reads from below.
[[nodiscard]] std::vector<PatternSetting> pattern_settings();

struct PatternRun {
  PatternStatus status = PatternStatus::kBadInput;
  std::string message;
  LensVector error = LensVector::Zero();
  double line_delay_s = 0;
  LensMatrix covariance = LensMatrix::Zero();
  LensMatrix bound = LensMatrix::Zero();
  double cpu_s = 0;  // of the calibration
  double knots_per_frame = 0;
};

// bounded: with the bound, which takes as long as the calibration.
[[nodiscard]] PatternRun run_pattern(const PatternScene& scene, bool bounded);

// Groups of parameters that belong together.
struct LensGroup {
  const char* name;
  int first;  // LensParameter
  int size;
};
inline constexpr LensGroup kLensGroups[] = {
    {"line delay", index(LensParameter::kLineDelay), 1},
    {"focal lengths", index(LensParameter::kFocalLengthU), 2},
    {"centre", index(LensParameter::kCentreU), 2},
    {"distortion", index(LensParameter::kK1), 4}};

// e^T C^-1 e of the group: chi-square of group.size degrees of freedom, if C is the error's covariance.
[[nodiscard]] double squared_distance(const LensVector& error, const LensMatrix& covariance,
                                      const LensGroup& group);

}  // namespace alidade::test

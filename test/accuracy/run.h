#pragma once
// One Monte-Carlo run: a recording made, calibrated, and compared with its truth and its bound.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "test/accuracy/bound.h"
#include "test/accuracy/statistics.h"

namespace alidade::test {

// An error of more than this many reported standard deviations is wrong and unsaid. One Gaussian number
// in 1.7 million is larger.
inline constexpr double kWrongSigmas = 5;

struct Run {
  std::string name;  // "seed 7" or a folder
  Simulation simulation;
  CalibrationStatus status = CalibrationStatus::kBadInput;
  std::string message;
  bool estimated = false;  // there are numbers: published, or solved and refused as too weak
  double cpu_s = 0;        // of calibrate() alone
  int segments = 0;
  double mean_pixel_error = 0;  // over sigma

  Calibration estimate;
  ParameterVector error = ParameterVector::Zero();
  ParameterVector sigma = ParameterVector::Zero();
  ParameterVector bound = ParameterVector::Zero();     // zero: given, or no bound
  ParameterVector expected = ParameterVector::Ones();  // of (error / sigma)^2, see expected_nees()
  // Pan and tilt axis: angle to the truth (rad), and its mean square over two degrees of freedom in
  // units of the reported covariance and of the bound.
  Eigen::Vector2d axis_angle = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_nees = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_over_bound = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_mean_at_bound = Eigen::Vector2d::Zero();  // mean angle of an estimator there

  [[nodiscard]] bool published() const { return status == CalibrationStatus::kOk; }
  [[nodiscard]] bool wrong() const;  // published, and beyond kWrongSigmas
  [[nodiscard]] std::string describe_failure() const;
  [[nodiscard]] nlohmann::json to_json() const;
};

// spread: standard deviations of the truth about the priors' means, see expected_nees().
[[nodiscard]] Run run_recording(const Simulation& simulation, const SimulatedRecording& recording,
                                const CalibrationOptions& options, const ParameterVector& spread);

// (error / reported sigma)^2, error / bound, ... of one parameter, over all runs with numbers.
[[nodiscard]] std::vector<double> normalised_errors(const std::vector<Run>& runs, Parameter p);
[[nodiscard]] std::vector<double> errors_over_bound(const std::vector<Run>& runs, Parameter p);
[[nodiscard]] std::vector<double> absolute_errors(const std::vector<Run>& runs, Parameter p);

}  // namespace alidade::test

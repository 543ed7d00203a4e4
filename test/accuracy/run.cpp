#include "test/accuracy/run.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <boost/math/special_functions/ellint_2.hpp>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

double cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// e^T C^-1 e / 2 of an axis, C given in a basis of its tangent plane.
double axis_mean_square(const Eigen::Vector3d& error, const Eigen::Matrix<double, 3, 2>& basis,
                        const Eigen::Matrix2d& covariance) {
  if (covariance.determinant() <= 0) return 0;
  const Eigen::Vector2d e = basis.transpose() * error;
  return e.dot(covariance.inverse() * e) / 2;
}

// Mean length of a Gaussian vector in the plane: with the larger sigma a and the smaller one b,
// sqrt(2 / pi) a E(sqrt(1 - b^2 / a^2)), E the complete elliptic integral of the second kind.
double mean_length(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const double large = solver.eigenvalues()[1];
  if (!(large > 0)) return 0;
  const double ratio = std::max(0.0, solver.eigenvalues()[0]) / large;
  return std::sqrt(2 / kPi * large) * boost::math::ellint_2(std::sqrt(1 - ratio));
}

}  // namespace

Run run_recording(const Simulation& s, const SimulatedRecording& recording,
                  const CalibrationOptions& options, const ParameterVector& spread) {
  Run run;
  run.name = "seed " + std::to_string(s.seed);
  run.simulation = s;
  const double begin = cpu_time();
  const CalibrationResult result = calibrate(recording.input, options);
  run.cpu_s = cpu_time() - begin;
  run.status = result.status;
  run.message = result.message;
  run.estimated = result.ok() || result.status == CalibrationStatus::kWeak;
  const Bound bound = compute_bound(s, recording, options);
  if (bound.ok) {
    run.bound = bound.covariance.diagonal().cwiseSqrt();
    run.expected = expected_nees(bound, spread);
    run.axis_mean_at_bound = {mean_length(bound.covariance.block<2, 2>(
                                  index(Parameter::kPanAxis0), index(Parameter::kPanAxis0))),
                              mean_length(bound.covariance.block<2, 2>(
                                  index(Parameter::kTiltAxis0), index(Parameter::kTiltAxis0)))};
  }
  if (!run.estimated) return run;

  run.estimate = result.calibration;
  run.segments = result.trajectory.segments();
  run.mean_pixel_error = result.quality.mean_reprojection_error_px / s.pixel_sigma;
  run.error = calibration_error(s, result.calibration);
  run.sigma = result.calibration.covariance.diagonal().cwiseSqrt();
  const Mechanics<double>& mechanics = result.calibration.mechanics;
  for (const int i : {0, 1}) {
    const Eigen::Vector3d estimate = i == 0 ? mechanics.pan_axis : mechanics.tilt_axis;
    const Eigen::Vector3d truth = i == 0 ? s.pan_axis : s.tilt_axis;
    const int first = index(i == 0 ? Parameter::kPanAxis0 : Parameter::kTiltAxis0);
    const Eigen::Vector3d error = estimate - truth;
    run.axis_angle[i] = error.norm();
    run.axis_nees[i] = axis_mean_square(error, tangent_basis<double>(estimate),
                                        result.calibration.covariance.block<2, 2>(first, first));
    run.axis_over_bound[i] =
        bound.ok ? axis_mean_square(error, i == 0 ? bound.pan_basis : bound.tilt_basis,
                                    bound.covariance.block<2, 2>(first, first))
                 : 0;
  }
  return run;
}

bool Run::wrong() const {
  if (!published()) return false;
  for (int i = 0; i < kParameterCount; ++i) {
    // Also true of NaN. A parameter taken as exact has no error but rounding.
    if (sigma[i] > 0 && !(std::abs(error[i]) <= kWrongSigmas * sigma[i])) return true;
  }
  return false;
}

std::string Run::describe_failure() const {
  if (!published()) return name + ": refused, " + to_string(status) + ": " + message;
  std::string text = name + ": wrong and unsaid:";
  for (int i = 0; i < kParameterCount; ++i) {
    if (sigma[i] > 0 && !(std::abs(error[i]) <= kWrongSigmas * sigma[i])) {
      text += std::string(" ") + to_string(static_cast<Parameter>(i)) + " by " +
              number(error[i] / sigma[i]) + " sigma";
    }
  }
  return text;
}

nlohmann::json Run::to_json() const {
  nlohmann::json parameters;
  for (int i = 0; i < kParameterCount; ++i) {
    parameters[to_string(static_cast<Parameter>(i))] = {
        {"error", error[i]}, {"sigma", sigma[i]}, {"bound", bound[i]}};
  }
  return {{"name", name},
          {"status", to_string(status)},
          {"message", message},
          {"cpu_s", cpu_s},
          {"segments", segments},
          {"mean_pixel_error_over_sigma", mean_pixel_error},
          {"focal_length_px", simulation.focal_length},
          {"pan_axis_error_rad", axis_angle[0]},
          {"tilt_axis_error_rad", axis_angle[1]},
          {"parameters", parameters}};
}

std::vector<double> normalised_errors(const std::vector<Run>& runs, Parameter p) {
  std::vector<double> values;
  for (const Run& run : runs) {
    const double sigma = run.sigma[index(p)];
    if (run.estimated && sigma > 0) values.push_back(run.error[index(p)] / sigma);
  }
  return values;
}

std::vector<double> errors_over_bound(const std::vector<Run>& runs, Parameter p) {
  std::vector<double> values;
  for (const Run& run : runs) {
    const double bound = run.bound[index(p)];
    if (run.estimated && bound > 0) values.push_back(run.error[index(p)] / bound);
  }
  return values;
}

std::vector<double> absolute_errors(const std::vector<Run>& runs, Parameter p) {
  std::vector<double> values;
  for (const Run& run : runs) {
    const double unit = p == Parameter::kFocalLength ? run.simulation.focal_length : 1;
    if (run.estimated) values.push_back(std::abs(run.error[index(p)]) / unit);
  }
  return values;
}

}  // namespace alidade::test

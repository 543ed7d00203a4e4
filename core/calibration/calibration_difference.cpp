#include "core/calibration/calibration_difference.h"

#include <Eigen/LU>
#include <algorithm>

#include "core/calibration/axes_turn.h"
#include "core/model/direction.h"

namespace alidade {
namespace {

constexpr int kCount = static_cast<int>(kComparedParameters.size());

using Compared = Eigen::Matrix<double, kCount, 1>;
using ComparedCovariance = Eigen::Matrix<double, kCount, kCount>;

// b - a, by Parameter.
Eigen::Matrix<double, kParameterCount, 1> difference(const Calibration& a, const Calibration& b) {
  Eigen::Matrix<double, kParameterCount, 1> d;
  for (int i = 0; i < kParameterCount; ++i) {
    const auto parameter = static_cast<Parameter>(i);
    d[i] = parameter_value(b, parameter) - parameter_value(a, parameter);
  }
  d.segment<2>(index(Parameter::kPanAxis0)) =
      direction_minus(b.mechanics.pan_axis, a.mechanics.pan_axis);
  d.segment<2>(index(Parameter::kTiltAxis0)) =
      direction_minus(b.mechanics.tilt_axis, a.mechanics.tilt_axis);
  return d;
}

}  // namespace

double difference_chi_square(const Calibration& a, const Calibration& b, bool with_clock_offset) {
  const auto d = difference(a, b);
  const ParameterCovariance<double> T = internal::axes_turn(b.mechanics, a.mechanics);
  const ParameterCovariance<double> of_b = T * b.covariance * T.transpose();
  ComparedCovariance covariance;
  Compared x;
  for (int i = 0; i < kCount; ++i) {
    const int row = index(kComparedParameters[static_cast<std::size_t>(i)]);
    x[i] = d[row];
    for (int j = 0; j < kCount; ++j) {
      const int column = index(kComparedParameters[static_cast<std::size_t>(j)]);
      covariance(i, j) = a.covariance(row, column) + of_b(row, column);
    }
  }
  if (!with_clock_offset) {
    covariance.row(kCount - 1).setZero();
    covariance.col(kCount - 1).setZero();
    covariance(kCount - 1, kCount - 1) = 1;
    x[kCount - 1] = 0;
  }
  // Scaled by the sigmas, as those of the parameters differ by many orders of magnitude.
  const Compared scale = covariance.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const ComparedCovariance correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Compared normalised = scale.cwiseProduct(x);
  return normalised.dot(correlation.inverse() * normalised);
}

bool is_sharper(const Calibration& after, const Calibration& before, double share) {
  return std::any_of(kComparedParameters.begin(), kComparedParameters.end(), [&](Parameter p) {
    return parameter_sigma(after, p) < share * parameter_sigma(before, p);
  });
}

}  // namespace alidade

#pragma once
// The one numeric Jacobian of all tests, beside which analytic ones are checked.
// J = (8 (f(+h) - f(-h)) - (f(+2h) - f(-2h))) / 12 h for each input: an error of order h^4 f''''', plus the
// rounding 1.5 noise / h of values that carry an absolute error of `noise`.
// f takes a small change of its input (so that a manifold's (+) stands in the test) and returns the output,
// or nullopt where there is none. evaluated counts the outputs obtained: 4 for each input, or the test
// has skipped something, and a skipped column is NaN so that no comparison with it succeeds.

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <optional>

namespace alidade::test {

template <int kOut, int kIn>
struct NumericJacobian {
  Eigen::Matrix<double, kOut, kIn> J;
  int evaluated = 0;
};

template <int kOut, int kIn, class Function>
[[nodiscard]] NumericJacobian<kOut, kIn> numeric_jacobian(
    const Function& f, const Eigen::Matrix<double, kIn, 1>& steps) {
  using In = Eigen::Matrix<double, kIn, 1>;
  using Out = Eigen::Matrix<double, kOut, 1>;
  NumericJacobian<kOut, kIn> result;
  for (int i = 0; i < kIn; ++i) {
    const auto evaluate = [&](double multiple) -> Out {
      In change = In::Zero();
      change[i] = multiple * steps[i];
      const std::optional<Out> out = f(change);
      if (!out) return Out::Constant(std::numeric_limits<double>::quiet_NaN());
      ++result.evaluated;
      return *out;
    };
    result.J.col(i) =
        (8 * (evaluate(1) - evaluate(-1)) - (evaluate(2) - evaluate(-2))) / (12 * steps[i]);
  }
  return result;
}

template <int kOut, int kIn, class Function>
[[nodiscard]] NumericJacobian<kOut, kIn> numeric_jacobian(const Function& f, double step) {
  return numeric_jacobian<kOut, kIn>(
      f, Eigen::Matrix<double, kIn, 1>(Eigen::Matrix<double, kIn, 1>::Constant(step)));
}

// The worst column's |J - expected| / (|expected| + floor): columns of one Jacobian can be ten orders apart.
// NaN, which no bound admits, if there is one in either.
template <int kOut, int kIn>
[[nodiscard]] double worst_column_error(const Eigen::Matrix<double, kOut, kIn>& J,
                                        const Eigen::Matrix<double, kOut, kIn>& expected,
                                        const Eigen::Matrix<double, kIn, 1>& floor) {
  double worst = 0;
  for (int i = 0; i < kIn; ++i) {
    const double error = (J.col(i) - expected.col(i)).norm() / (expected.col(i).norm() + floor[i]);
    if (!(error <= worst)) worst = error;
    if (worst != worst) break;
  }
  return worst;
}

template <int kOut, int kIn>
[[nodiscard]] double worst_column_error(const Eigen::Matrix<double, kOut, kIn>& J,
                                        const Eigen::Matrix<double, kOut, kIn>& expected,
                                        double floor) {
  return worst_column_error<kOut, kIn>(
      J, expected, Eigen::Matrix<double, kIn, 1>(Eigen::Matrix<double, kIn, 1>::Constant(floor)));
}

}  // namespace alidade::test

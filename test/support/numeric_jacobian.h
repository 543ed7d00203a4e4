#pragma once
// The one numeric Jacobian of all tests, beside which analytic ones are checked.
// J = (8 (f(+h) - f(-h)) - (f(+2h) - f(-2h))) / 12 h for each input: its error is of order h^4,
// plus a rounding of 1.5 noise / h if the values of f carry an absolute error of `noise`.
// f takes a small change of its input (so that a manifold's (+) stands in the test) and returns the
// output, or nullopt where there is none. evaluated counts the outputs: 4 for each input, or the
// test has skipped something; a skipped column is NaN, with which no comparison succeeds.

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace alidade::test {

template <int kOut, int kIn>
struct NumericJacobian {
  Eigen::Matrix<double, kOut, kIn> J;
  Eigen::Matrix<double, kIn, 1> steps;
  int evaluated = 0;
};

template <int kOut, int kIn>
using NumericFunction = std::function<std::optional<Eigen::Matrix<double, kOut, 1>>(
    const Eigen::Matrix<double, kIn, 1>&)>;

template <int kOut, int kIn>
[[nodiscard]] NumericJacobian<kOut, kIn> numeric_jacobian(
    const NumericFunction<kOut, kIn>& f, const Eigen::Matrix<double, kIn, 1>& steps) {
  using In = Eigen::Matrix<double, kIn, 1>;
  using Out = Eigen::Matrix<double, kOut, 1>;
  NumericJacobian<kOut, kIn> result;
  result.steps = steps;
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

template <int kOut, int kIn>
[[nodiscard]] NumericJacobian<kOut, kIn> numeric_jacobian(const NumericFunction<kOut, kIn>& f,
                                                          double step) {
  return numeric_jacobian<kOut, kIn>(
      f, Eigen::Matrix<double, kIn, 1>(Eigen::Matrix<double, kIn, 1>::Constant(step)));
}

// The worst column's |J - numeric| as a multiple of what the numeric one may be off: a millionth of
// itself by truncation, 1.5 noise / step by rounding. Columns of one Jacobian can be ten orders
// apart, hence each by itself. Below 1 is agreement; NaN if there is one in either.
template <int kOut, int kIn>
[[nodiscard]] double disagreement(const Eigen::Matrix<double, kOut, kIn>& J,
                                  const NumericJacobian<kOut, kIn>& numeric, double noise) {
  double worst = 0;
  for (int i = 0; i < kIn; ++i) {
    const double allowed = 1e-6 * numeric.J.col(i).norm() + 1.5 * noise / numeric.steps[i];
    const double ratio = (J.col(i) - numeric.J.col(i)).norm() / allowed;
    if (!(ratio <= worst)) worst = ratio;
    if (std::isnan(worst)) break;
  }
  return worst;
}

}  // namespace alidade::test

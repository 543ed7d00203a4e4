#include "core/calibration/chance.h"

#include <cmath>

namespace alidade::internal {

namespace {

// Both of the regularised upper incomplete gamma function Q(a, x).
double log_by_series(double a, double x) {
  double term = 1 / a;
  double sum = term;
  for (int n = 1; n < 10000 && term > 1e-16 * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return std::log1p(-sum * std::exp(a * std::log(x) - x - std::lgamma(a)));
}

// Continued fraction, by Lentz's method.
double log_by_fraction(double a, double x) {
  double b = x + 1 - a;
  double c = 1e300;
  double d = 1 / b;
  double fraction = d;
  for (int n = 1; n < 10000; ++n) {
    const double numerator = -n * (n - a);
    b += 2;
    d = 1 / (numerator * d + b);
    c = b + numerator / c;
    fraction *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return a * std::log(x) - x - std::lgamma(a) + std::log(fraction);
}

}  // namespace

double log_chance(double value, double freedom) {
  if (!(value > 0)) return 0;
  const double a = freedom / 2;
  const double x = value / 2;
  return x < a + 1 ? log_by_series(a, x) : log_by_fraction(a, x);
}

}  // namespace alidade::internal

#pragma once
// Errors of telemetry's angles besides scale and noise, for each axis:
//   measured = scale true + g(true) + play                              (play: play.h)
// The curve g of the true angle is Catmull-Rom between uniform knots, linear in the knots' values.
// At the distance d beyond the edge knot the curve fades: g = g(edge) e, e = exp(-d^2 / (2
// length^2)), and its variance goes over to unseen_sigma^2. Knots of a whole turn have no edge.
// Angles are rad, any turn; they are wrapped here. The slope of g must stay below the scale, so
// that the inverse exists: see validate(). Plain values in fixed memory; no allocation.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"
#include "core/model/mechanics.h"
#include "core/model/play.h"

namespace alidade {

// g = sum of value[i] * values[knot[i]]; its slope likewise. Without knots all are 0.
struct CurveWeights {
  std::array<int, 4> knot{};
  Vector4<double> value = Vector4<double>::Zero();
  Vector4<double> slope = Vector4<double>::Zero();  // 1/rad
  double seen = 0;                                  // e: 1 within the knots, towards 0 beyond
};

struct AngleErrorCurve {
  static constexpr int kMaxKnots = 128;

  double first_rad = 0;                    // true angle of the first knot
  double spacing_rad = 0;                  // > 0 with two knots or more
  int count = 0;                           // knots; 0: no curve
  std::array<double, kMaxKnots> values{};  // rad
  std::array<double, kMaxKnots> sigmas{};  // rad, of the values
  double length_rad = 0;                   // correlation length of the values' errors
  double unseen_sigma_rad = 0;             // of g far from all knots

  // False: nothing is known of an error.
  [[nodiscard]] bool exists() const { return count > 0 || unseen_sigma_rad > 0; }
  [[nodiscard]] double extent_rad() const { return count > 1 ? (count - 1) * spacing_rad : 0; }
  // The last knot's neighbour is the first.
  [[nodiscard]] bool fills_turn() const {
    constexpr double kRounding = 1e-9;
    return count > 3 && std::abs(count * spacing_rad - 2 * kPi) < kRounding;
  }

  [[nodiscard]] CurveWeights weights(double true_angle) const {
    CurveWeights out;
    if (count < 1) return out;
    const Place at = place(true_angle);
    out.seen = fade(at.beyond);
    if (count == 1) {
      out.value[0] = out.seen;
      if (length_rad > 0) out.slope[0] = -at.beyond / (length_rad * length_rad) * out.seen;
      return out;
    }
    const double t = at.fraction;
    out.value << t * (-1 + t * (2 - t)), 2 + t * t * (3 * t - 5), t * (1 + t * (4 - 3 * t)),
        t * t * (t - 1);
    out.value *= 0.5 * out.seen;
    if (at.beyond == 0) {
      out.slope << -1 + t * (4 - 3 * t), t * (9 * t - 10), 1 + t * (8 - 9 * t), t * (3 * t - 2);
      out.slope *= 0.5 / spacing_rad;
    } else if (length_rad > 0) {
      out.slope = -at.beyond / (length_rad * length_rad) * out.value;
    }
    for (int i = 0; i < 4; ++i) out.knot[static_cast<std::size_t>(i)] = at.knot - 1 + i;
    if (fills_turn()) {
      for (int& knot : out.knot) knot = (knot + count) % count;
    } else {
      continue_straight(0, 1, 2, &out);
      continue_straight(3, 2, 1, &out);
    }
    return out;
  }

  // g, rad; *slope, if not null: dg / d true angle.
  [[nodiscard]] double at(double true_angle, double* slope = nullptr) const {
    const CurveWeights w = weights(true_angle);
    double g = 0;
    double rise = 0;
    for (int i = 0; i < 4; ++i) {
      const double value = values[static_cast<std::size_t>(w.knot[static_cast<std::size_t>(i)])];
      g += w.value[i] * value;
      rise += w.slope[i] * value;
    }
    if (slope != nullptr) *slope = rise;
    return g;
  }

  // rad, one standard deviation of the error that remains after at() is subtracted.
  [[nodiscard]] double sigma(double true_angle) const {
    if (count < 1) return unseen_sigma_rad;
    const Place at = place(true_angle);
    const auto knot = static_cast<std::size_t>(at.knot);
    const std::size_t next = fills_turn() ? (knot + 1) % static_cast<std::size_t>(count)
                                          : std::min(knot + 1, static_cast<std::size_t>(count) - 1);
    const double known = (1 - at.fraction) * sigmas[knot] + at.fraction * sigmas[next];
    const double seen = fade(at.beyond);
    return std::sqrt(seen * seen * known * known +
                     (1 - seen * seen) * unseen_sigma_rad * unseen_sigma_rad);
  }

  // False if a value is invalid, or if the curve may have no inverse at scales near 1. *error, if
  // not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
    constexpr double kSteepest = 0.25;  // of a chord; the curve's slope is twice that at most
    const char* problem = nullptr;
    if (!not_negative(unseen_sigma_rad)) problem = "the unseen sigma must not be negative";
    if (!not_negative(length_rad)) problem = "the length must not be negative";
    if (count < 0 || count > kMaxKnots) problem = "there must be 0 to 128 knots";
    if (problem == nullptr && count > 1 &&
        !(std::isfinite(spacing_rad) && spacing_rad > 0 && extent_rad() < 2 * kPi)) {
      problem = "the knots must rise, and lie within one turn";
    }
    if (!std::isfinite(first_rad)) problem = "the first knot must be finite";
    if (problem == nullptr && count > 0 && !fills_turn() && length_rad > 0) {
      const double edges =
          std::max(std::abs(values[0]), std::abs(values[static_cast<std::size_t>(count - 1)]));
      if (!(edges < kSteepest * length_rad)) problem = "the length is too short for the values";
    }
    for (int i = 0; problem == nullptr && i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!not_negative(sigmas[k])) problem = "a sigma must not be negative";
      if (!(std::abs(values[k]) < kSteepest)) problem = "a value must be small";
      if (problem == nullptr && i > 0 &&
          !(std::abs(values[k] - values[k - 1]) < kSteepest * spacing_rad)) {
        problem = "neighbouring values must differ by less than a quarter of the knots' distance";
      }
    }
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }

 private:
  // Between knot and knot + 1; or outside by `beyond` (rad), and at the nearer edge.
  struct Place {
    int knot = 0;
    double fraction = 0;
    double beyond = 0;  // < 0: before the first knot
  };

  [[nodiscard]] Place place(double true_angle) const {
    const double extent = extent_rad();
    // In [0, 2 pi) from the first knot. An angle a rounding before it is at it.
    constexpr double kRounding = 1e-12;
    double from_first = wrap_angle(true_angle - first_rad);
    if (from_first < -kRounding) from_first += 2 * kPi;
    from_first = std::max(from_first, 0.0);
    Place out;
    if (fills_turn()) {
      const double knots = from_first / spacing_rad;
      out.knot = std::min(static_cast<int>(knots), count - 1);
      out.fraction = std::min(knots - out.knot, 1.0);
      return out;
    }
    if (from_first > extent) {
      const double after = from_first - extent;
      const double before = 2 * kPi - from_first;
      out.beyond = before < after ? -before : after;
      if (before < after) return out;
    }
    if (count < 2) return out;
    const double knots = std::min(from_first, extent) / spacing_rad;
    out.knot = std::min(static_cast<int>(knots), count - 2);
    out.fraction = std::min(knots - out.knot, 1.0);
    return out;
  }

  [[nodiscard]] double fade(double beyond) const {
    if (beyond == 0) return 1;
    if (!(length_rad > 0)) return 0;
    const double lengths = beyond / length_rad;
    return std::exp(-lengths * lengths / 2);
  }

  // A neighbour beyond the edge lies on the straight line through the two knots at the edge.
  void continue_straight(int beyond, int edge, int inner, CurveWeights* w) const {
    int& knot = w->knot[static_cast<std::size_t>(beyond)];
    if (knot >= 0 && knot < count) return;
    for (Vector4<double>* part : {&w->value, &w->slope}) {
      (*part)[edge] += 2 * (*part)[beyond];
      (*part)[inner] -= (*part)[beyond];
      (*part)[beyond] = 0;
    }
    knot = w->knot[static_cast<std::size_t>(edge)];
  }
};

struct TelemetryError {
  AngleErrorCurve pan;
  AngleErrorCurve tilt;
  Play pan_play;
  Play tilt_play;

  [[nodiscard]] bool exists() const {
    return pan.exists() || tilt.exists() || pan_play.exists() || tilt_play.exists();
  }
};

// One axis, without play. scale: measured / true.
[[nodiscard]] inline double measured_from_true(double scale, const AngleErrorCurve& error,
                                               double true_angle) {
  return scale * true_angle + error.at(true_angle);
}

// The inverse. *rate_factor, if not null: true rate / measured rate at this angle.
[[nodiscard]] inline double true_from_measured(double scale, const AngleErrorCurve& error,
                                               double measured, double* rate_factor = nullptr) {
  double angle = measured / scale;
  double slope = 0;
  if (error.count > 0) {
    constexpr int kMaxSteps = 60;
    constexpr double kExact_rad = 1e-15;
    for (int step = 0; step < kMaxSteps; ++step) {
      const double left = measured - scale * angle - error.at(angle, &slope);
      angle += left / (scale + slope);
      if (!(std::abs(left) > kExact_rad * (1 + std::abs(measured)))) break;
    }
    static_cast<void>(error.at(angle, &slope));
  }
  if (rate_factor != nullptr) *rate_factor = 1 / (scale + slope);
  return angle;
}

// Both axes, without play.
[[nodiscard]] inline PanTilt<double> true_from_measured(const Mechanics<double>& mechanics,
                                                        const TelemetryError& error,
                                                        const PanTilt<double>& measured) {
  return {true_from_measured(mechanics.pan_scale, error.pan, measured.pan),
          true_from_measured(mechanics.tilt_scale, error.tilt, measured.tilt)};
}

}  // namespace alidade

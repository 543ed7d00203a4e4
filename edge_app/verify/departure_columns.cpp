#include "edge_app/verify/departure_columns.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

namespace alidade {
namespace {

constexpr int kAngleKnots = 13;
constexpr int kTimeKnots = 6;
constexpr double kLeastRange = 1e-3;  // rad or s, of a curve

// Piecewise linear, 1 at knot k and 0 at its neighbours.
double hat(double x, const std::vector<double>& knots, std::size_t k) {
  const double spacing = knots[1] - knots[0];
  return std::max(0.0, 1 - std::abs(x - knots[k]) / spacing);
}

std::vector<double> knots_over(double low, double high, int count) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) out.push_back(low + (high - low) * i / (count - 1));
  return out;
}

// Of a curve over x, what no polynomial of this degree (0 or 1) over the frames explains: the mean
// of f is the focal length, and the slope of a gear is a scale.
void take_out(int degree, const std::vector<double>& x, std::vector<double>* y) {
  const auto n = static_cast<int>(x.size());
  const double middle = (x.front() + x.back()) / 2;
  Eigen::MatrixXd A(n, degree + 1);
  A.col(0).setOnes();
  for (int i = 0; degree > 0 && i < n; ++i) A(i, 1) = x[static_cast<std::size_t>(i)] - middle;
  Eigen::Map<Eigen::VectorXd> values(y->data(), n);
  values -= (A * A.colPivHouseholderQr().solve(values)).eval();
}

template <class ValueOf>
DepartureColumns curve(Departure departure, FrameColumn::What what, double sign, int knots,
                       int degree, const std::vector<SeenFrame>& frames, const ValueOf& value_of) {
  DepartureColumns out{departure, {}, {}, {}, {}};
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const SeenFrame& frame : frames) {
    low = std::min(low, value_of(frame));
    high = std::max(high, value_of(frame));
  }
  if (!(high - low > kLeastRange)) return out;
  std::vector<double> x;
  x.reserve(frames.size());
  for (const SeenFrame& frame : frames) x.push_back(value_of(frame));
  out.at = knots_over(low, high, knots);
  for (std::size_t k = 0; k < out.at.size(); ++k) {
    FrameColumn column{what, {}};
    for (const double each : x) column.of_frame.push_back(sign * hat(each, out.at, k));
    take_out(degree, x, &column.of_frame);
    out.columns.push_back(std::move(column));
  }
  return out;
}

template <class HeadingOf>
DepartureColumns play(Departure departure, FrameColumn::What what,
                      const std::vector<SeenFrame>& frames, const HeadingOf& heading_of) {
  FrameColumn column{what, {}};
  for (const SeenFrame& frame : frames) column.of_frame.push_back(-0.5 * heading_of(frame));
  return {departure, {}, {column}, {}, {}};
}

template <class NoiseOf>
DepartureColumns noise(Departure departure, const std::vector<SeenFrame>& frames,
                       const NoiseOf& noise_of) {
  DepartureColumns out{departure, {}, {}, {}, {}};
  for (const SeenFrame& frame : frames) {
    out.noise.emplace_back(FrameNoise::Zero());
    noise_of(frame, &out.noise.back());
  }
  return out;
}

}  // namespace

std::vector<DepartureColumns> all_departures(const std::vector<SeenFrame>& frames) {
  using What = FrameColumn::What;
  const auto of = [](Departure departure, std::initializer_list<Parameter> parameters) {
    DepartureColumns out{departure, {}, {}, {}, {}};
    for (const Parameter parameter : parameters) out.parameters.push_back(index(parameter));
    return out;
  };
  const auto pan = [](const SeenFrame& frame) { return frame.by_all_samples.angle.pan; };
  const auto tilt = [](const SeenFrame& frame) { return frame.by_all_samples.angle.tilt; };
  const auto time = [](const SeenFrame& frame) { return frame.time_s; };
  return {of(Departure::kFocalLength, {Parameter::kFocalLength}),
          of(Departure::kDistortion, {Parameter::kRadialDistortion}),
          of(Departure::kCentre, {Parameter::kCentreU, Parameter::kCentreV}),
          of(Departure::kAspect, {Parameter::kAspect}),
          of(Departure::kLineDelay, {Parameter::kLineDelay}),
          of(Departure::kPanAxis, {Parameter::kPanAxis0, Parameter::kPanAxis1}),
          of(Departure::kTiltAxis, {Parameter::kTiltAxis0, Parameter::kTiltAxis1}),
          of(Departure::kClockOffset, {Parameter::kClockOffset}),
          curve(Departure::kPanGear, What::kPan, -1, kAngleKnots, 1, frames, pan),
          curve(Departure::kTiltGear, What::kTilt, -1, kAngleKnots, 1, frames, tilt),
          play(Departure::kPanPlay, What::kPan, frames,
               [](const SeenFrame& frame) { return frame.heading.pan; }),
          play(Departure::kTiltPlay, What::kTilt, frames,
               [](const SeenFrame& frame) { return frame.heading.tilt; }),
          curve(Departure::kFocalDrift, What::kFocalLength, 1, kTimeKnots, 0, frames, time),
          curve(Departure::kPanDrift, What::kPan, -1, kTimeKnots, 0, frames, time),
          curve(Departure::kTiltDrift, What::kTilt, -1, kTimeKnots, 0, frames, time),
          noise(Departure::kTimeJitter, frames,
                [](const SeenFrame& frame, FrameNoise* out) {
                  out->col(0).head<2>() = frame.by_all_samples.rate.vector();
                }),
          noise(Departure::kAngleNoise, frames,
                [](const SeenFrame&, FrameNoise* out) { out->topRows<2>().setIdentity(); })};
}

}  // namespace alidade

#include "core/calibration/shimmer.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

#include "core/model/median.h"

namespace alidade::internal {
namespace {

constexpr double kShort_s = 0.4;  // haze changes within 0.1 to 0.2 s
constexpr std::size_t kPairs = 60;
constexpr int kTerms = 6;            // of a polynomial of second order
constexpr std::size_t kPoints = 24;  // of a pair of frames, at least
constexpr double kFarAbove = 4;      // times the stated sigma
constexpr double kComesBack = 1.3;   // what drifts has 2

struct Point {
  int landmark = 0;
  Vector2<double> u;
};

struct Displacement {
  Vector2<double> at;
  Vector2<double> by;
};

// By landmark in each frame, as the observations are sorted by landmark first.
std::vector<std::vector<Point>> points_of_frames(const AdjustmentData& data) {
  std::vector<std::vector<Point>> frames(data.frame_time_s.size());
  for (const AdjustmentObservation& o : data.observations)
    frames[static_cast<std::size_t>(o.frame)].push_back({o.landmark, o.u});
  return frames;
}

std::vector<Displacement> displacements(const std::vector<Point>& before,
                                        const std::vector<Point>& after) {
  std::vector<Displacement> out;
  std::size_t j = 0;
  for (const Point& point : before) {
    while (j < after.size() && after[j].landmark < point.landmark) ++j;
    if (j == after.size()) break;
    if (after[j].landmark == point.landmark) out.push_back({point.u, after[j].u - point.u});
  }
  return out;
}

// Variance of one component about a polynomial of the place, by the median: a part of the points
// may move otherwise. The squared length of a Gaussian residual has the median 2 ln 2 variances.
double variance_about_polynomial(const std::vector<Displacement>& moved) {
  const auto n = static_cast<Eigen::Index>(moved.size());
  Vector2<double> middle = Vector2<double>::Zero();
  for (const Displacement& d : moved) middle += d.at / static_cast<double>(n);
  double extent = 1;
  for (const Displacement& d : moved)
    extent = std::max(extent, (d.at - middle).cwiseAbs().maxCoeff());
  Eigen::MatrixXd A(n, kTerms);
  Eigen::MatrixXd b(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Displacement& d = moved[static_cast<std::size_t>(i)];
    const Vector2<double> x = (d.at - middle) / extent;
    A.row(i) << 1, x.x(), x.y(), x.x() * x.x(), x.x() * x.y(), x.y() * x.y();
    b.row(i) = d.by.transpose();
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  double variance = 0;
  for (int round = 0; round < 4; ++round) {
    const Eigen::MatrixXd WA = weight.asDiagonal() * A;
    const Eigen::MatrixXd coefficients = WA.colPivHouseholderQr().solve(weight.asDiagonal() * b);
    const Eigen::VectorXd square = (b - A * coefficients).rowwise().squaredNorm();
    std::vector<double> squares(square.begin(), square.end());
    variance = median(std::move(squares)) / (2 * std::log(2.0)) * static_cast<double>(n) /
               static_cast<double>(n - kTerms);
    weight = (1 + square.array() / (4 * std::max(variance, 1e-12))).rsqrt();
  }
  return variance;
}

// Median over pairs of frames that are so far apart; 0: none.
double variance_after(const AdjustmentData& data, const std::vector<std::vector<Point>>& frames,
                      double lag_s) {
  const std::vector<double>& time_s = data.frame_time_s;
  const std::size_t step = std::max<std::size_t>(1, time_s.size() / kPairs);
  std::vector<double> variances;
  for (std::size_t i = 0; i < time_s.size(); i += step) {
    const auto later = std::lower_bound(time_s.begin(), time_s.end(), time_s[i] + lag_s);
    if (later == time_s.end()) break;
    if (*later > time_s[i] + 1.5 * lag_s) continue;
    const std::vector<Displacement> moved =
        displacements(frames[i], frames[static_cast<std::size_t>(later - time_s.begin())]);
    if (moved.size() >= kPoints) variances.push_back(variance_about_polynomial(moved));
  }
  return variances.empty() ? 0 : median(std::move(variances));
}

}  // namespace

bool Shimmer::is_haze(double noise_px) const {
  return rms_px > kFarAbove * noise_px && grows < kComesBack;
}

Shimmer find_shimmer(const AdjustmentData& data) {
  Shimmer out;
  if (data.observations.empty()) return out;
  const std::vector<std::vector<Point>> frames = points_of_frames(data);
  const double of_short = variance_after(data, frames, kShort_s);
  const double of_long = variance_after(data, frames, 2 * kShort_s);
  if (!(of_short > 0) || !(of_long > 0)) return out;
  out.rms_px = std::sqrt(of_short / 2);  // a difference of two
  out.grows = std::sqrt(of_long / of_short);
  std::vector<double> sigmas;
  sigmas.reserve(data.observations.size());
  for (const AdjustmentObservation& o : data.observations) sigmas.push_back(o.sigma);
  out.stated_px = median(std::move(sigmas));
  return out;
}

std::string haze_text(const AdjustmentData& data, double sigma_ratio) {
  const Shimmer shimmer = find_shimmer(data);
  const double noise_px = shimmer.stated_px / sigma_ratio;
  if (!shimmer.is_haze(noise_px)) return {};
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(),
                ": haze: points of the pictures move to and fro against their neighbours by %.2g "
                "px within 0.4 s, %.0f times the tracks' noise; record when the ground is cool, or "
                "things that are nearer",
                shimmer.rms_px, shimmer.rms_px / noise_px);
  return text.data();
}

}  // namespace alidade::internal

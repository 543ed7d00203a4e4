#include "edge_app/verify/claim_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/calibration/chance.h"
#include "core/model/angle.h"
#include "edge_app/verify/covariance_root.h"

namespace alidade {
namespace {

// What the frames of the pairs claim.
struct Claims {
  std::vector<const FrameOrientation*> frames;
  std::vector<Matrix4<double>> motion;
  // Of each pair: what the calibrations' errors of unit variance do by its first and second frame.
  std::vector<Sensitivity<2>> by_first, by_second;
  // Calibrations have the same errors of unit variance at one zoom; if alike, at any.
  bool alike = false;
};

Claims claims_of(const std::vector<PairMean>& pairs, const std::vector<SeenFrame>& frames,
                 OrientationFrom from) {
  Claims out;
  std::vector<Matrix<double, kParameterCount, kParameterCount>> roots;
  for (const SeenFrame& frame : frames) {
    const FrameOrientation& is = orientation(frame, from);
    out.frames.push_back(&is);
    out.motion.emplace_back(is.motion_covariance.topLeftCorner<4, 4>());
    roots.emplace_back(covariance_root(is.calibration.covariance));
  }
  for (const PairMean& pair : pairs) {
    out.by_first.emplace_back(pair.P_first * roots[pair.first]);
    out.by_second.emplace_back(pair.P_second * roots[pair.second]);
  }
  return out;
}

// Of two pairs by their indices. Errors of pairs that share no frame are alike by the calibration
// alone.
Matrix2<double> pair_covariance(const std::vector<PairMean>& pairs, std::size_t index_a,
                                std::size_t index_b, const Claims& claims) {
  const PairMean& a = pairs[index_a];
  const PairMean& b = pairs[index_b];
  const std::vector<Matrix4<double>>& motion = claims.motion;
  Matrix2<double> out = Matrix2<double>::Zero();
  const auto add = [&](std::size_t of_a, std::size_t of_b, const Sensitivity<2>& by_a,
                       const Sensitivity<2>& by_b) {
    if (claims.alike || is_same_zoom(*claims.frames[of_a], *claims.frames[of_b]))
      out += by_a * by_b.transpose();
  };
  add(a.first, b.first, claims.by_first[index_a], claims.by_first[index_b]);
  add(a.first, b.second, claims.by_first[index_a], claims.by_second[index_b]);
  add(a.second, b.first, claims.by_second[index_a], claims.by_first[index_b]);
  add(a.second, b.second, claims.by_second[index_a], claims.by_second[index_b]);
  if (a.first == b.first) out += a.J_first * motion[a.first] * b.J_first.transpose();
  if (a.first == b.second) out += a.J_first * motion[a.first] * b.J_second.transpose();
  if (a.second == b.first) out += a.J_second * motion[a.second] * b.J_first.transpose();
  if (a.second == b.second) out += a.J_second * motion[a.second] * b.J_second.transpose();
  if (a.first == b.first && a.second == b.second) out += a.noise;
  return out;
}

}  // namespace

double chi_square_at(double z, double freedom) {
  const double part = 2 / (9 * freedom);
  const double root = std::max(0.0, 1 - part + z * std::sqrt(part));
  return freedom * root * root * root;
}

std::vector<PairMean> pair_means(const std::vector<PairRows>& pairs, double noise_factor) {
  std::vector<PairMean> out;
  for (const PairRows& pair : pairs) {
    PairMean mean;
    mean.first = pair.first;
    mean.second = pair.second;
    Matrix2<double> information = Matrix2<double>::Zero();
    for (const PlaceRow& place : pair.places) {
      const Matrix2<double> weight = place.covariance.inverse() / noise_factor;
      information += weight;
      mean.residual += weight * place.residual;
      mean.J_first += weight * place.J_first;
      mean.J_second += weight * place.J_second;
      mean.P_first += weight * place.P_first;
      mean.P_second += weight * place.P_second;
    }
    mean.noise = information.inverse();
    mean.residual = (mean.noise * mean.residual).eval();
    mean.J_first = (mean.noise * mean.J_first).eval();
    mean.J_second = (mean.noise * mean.J_second).eval();
    mean.P_first = (mean.noise * mean.P_first).eval();
    mean.P_second = (mean.noise * mean.P_second).eval();
    if (all_finite(mean.residual) && all_finite(mean.noise)) out.push_back(mean);
  }
  return out;
}

ClaimResult check_claims(const std::vector<PairMean>& pairs, const std::vector<SeenFrame>& frames,
                         OrientationFrom from, double motion_inflation) {
  ClaimResult out;
  out.pairs = static_cast<int>(pairs.size());
  if (pairs.empty()) return out;
  Claims claims = claims_of(pairs, frames, from);
  std::set<std::size_t> used;
  std::vector<Matrix2<double>> whiten;  // L^-1
  double squares = 0;
  double angles = 0;
  double normalised = 0;
  double claimed = 0;
  bool is_one_zoom = true;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairMean& pair = pairs[i];
    used.insert(pair.first);
    used.insert(pair.second);
    const FrameOrientation& second = *claims.frames[pair.second];
    is_one_zoom = is_one_zoom && is_same_zoom(*claims.frames[pairs.front().first], second) &&
                  is_same_zoom(*claims.frames[pair.first], second);
    const Matrix2<double> covariance = pair_covariance(pairs, i, i, claims);
    const Matrix2<double> L = covariance.llt().matrixL();
    whiten.push_back(L.inverse());
    const double f = second.calibration.camera.focal_length;
    squares += pair.residual.squaredNorm();
    angles += pair.residual.squaredNorm() / (f * f);
    claimed += covariance.trace();
    normalised += (whiten.back() * pair.residual).squaredNorm();
  }
  double trace = 0;
  out.freedom = 2.0 * out.pairs;
  for (const bool alike : {false, true}) {
    if (alike && is_one_zoom) break;
    claims.alike = alike;
    double here = 0;
    double correlations = 0;
    for (std::size_t a = 0; a < pairs.size(); ++a) {
      for (std::size_t b = 0; b < pairs.size(); ++b) {
        const Matrix2<double> covariance =
            whiten[a] * pair_covariance(pairs, a, b, claims) * whiten[b].transpose();
        correlations += covariance.squaredNorm();
        if (a == b) here += covariance.trace();
      }
    }
    trace = std::max(trace, here);
    out.freedom = std::min(out.freedom, here * here / (correlations * motion_inflation));
  }
  out.frames = static_cast<int>(used.size());
  out.rms_px = std::sqrt(squares / out.pairs);
  out.rms_deg = std::sqrt(angles / out.pairs) * 180 / kPi;
  out.claimed_px = std::sqrt(claimed / out.pairs);
  out.ratio = std::sqrt(normalised / trace);
  constexpr double kTwoSided95 = 1.959964;
  out.low = out.ratio * std::sqrt(out.freedom / chi_square_at(kTwoSided95, out.freedom));
  out.high = out.ratio *
             std::sqrt(out.freedom / std::max(1e-12, chi_square_at(-kTwoSided95, out.freedom)));
  out.log_chance = internal::log_chance(out.freedom * out.ratio * out.ratio, out.freedom);
  return out;
}

}  // namespace alidade

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

using ParameterRoot = Matrix<double, kParameterCount, kParameterCount>;

// What the frames claim.
struct Claims {
  std::vector<Matrix4<double>> motion;
  std::vector<ParameterRoot> parameters;  // root of the covariance
  // Where calibrations have the same error: at one zoom, or, if alike, at all.
  std::vector<const FrameOrientation*> frames;
  bool alike = false;
};

Matrix2<double> covariance_by(const Claims& claims, std::size_t frame_a, std::size_t frame_b,
                              const Sensitivity<2>& P_a, const Sensitivity<2>& P_b) {
  if (!claims.alike && !is_same_zoom(*claims.frames[frame_a], *claims.frames[frame_b]))
    return Matrix2<double>::Zero();
  return (P_a * claims.parameters[frame_a]) * (P_b * claims.parameters[frame_b]).transpose();
}

// Errors of pairs that share no frame are alike by the calibration alone.
Matrix2<double> pair_covariance(const PairMean& a, const PairMean& b, const Claims& claims) {
  const std::vector<Matrix4<double>>& motion = claims.motion;
  Matrix2<double> out = covariance_by(claims, a.first, b.first, a.P_first, b.P_first) +
                        covariance_by(claims, a.first, b.second, a.P_first, b.P_second) +
                        covariance_by(claims, a.second, b.first, a.P_second, b.P_first) +
                        covariance_by(claims, a.second, b.second, a.P_second, b.P_second);
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
  Claims claims;
  for (const SeenFrame& frame : frames) {
    const FrameOrientation& is = orientation(frame, from);
    claims.motion.emplace_back(is.motion_covariance.topLeftCorner<4, 4>());
    claims.parameters.emplace_back(covariance_root(is.calibration.covariance));
    claims.frames.push_back(&is);
  }
  std::set<std::size_t> used;
  std::vector<Matrix2<double>> whiten;  // L^-1
  double squares = 0;
  double angles = 0;
  double normalised = 0;
  double claimed = 0;
  bool is_one_zoom = true;
  for (const PairMean& pair : pairs) {
    used.insert(pair.first);
    used.insert(pair.second);
    const FrameOrientation& second = *claims.frames[pair.second];
    is_one_zoom = is_one_zoom && is_same_zoom(*claims.frames[pairs.front().first], second) &&
                  is_same_zoom(*claims.frames[pair.first], second);
    const Matrix2<double> covariance = pair_covariance(pair, pair, claims);
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
            whiten[a] * pair_covariance(pairs[a], pairs[b], claims) * whiten[b].transpose();
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

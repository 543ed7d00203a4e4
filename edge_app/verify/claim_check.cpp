#include "edge_app/verify/claim_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/calibration/chance.h"
#include "core/model/angle.h"

namespace alidade {
namespace {

// Errors of pairs that share no frame are alike by the calibration alone.
Matrix2<double> pair_covariance(const PairMean& a, const PairMean& b,
                                const std::vector<Matrix4<double>>& motion,
                                const ParameterCovariance<double>& parameters) {
  Matrix2<double> out = a.P * parameters * b.P.transpose();
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
      mean.P += weight * (place.P_first + place.P_second);
    }
    mean.noise = information.inverse();
    mean.residual = (mean.noise * mean.residual).eval();
    mean.J_first = (mean.noise * mean.J_first).eval();
    mean.J_second = (mean.noise * mean.J_second).eval();
    mean.P = (mean.noise * mean.P).eval();
    if (all_finite(mean.residual) && all_finite(mean.noise)) out.push_back(mean);
  }
  return out;
}

ClaimResult check_claims(const std::vector<PairMean>& pairs,
                         const std::vector<Matrix4<double>>& motion,
                         const ParameterCovariance<double>& parameters, double motion_inflation,
                         double focal_length) {
  ClaimResult out;
  out.pairs = static_cast<int>(pairs.size());
  if (pairs.empty()) return out;
  std::set<std::size_t> frames;
  std::vector<Matrix2<double>> whiten;  // L^-1
  double squares = 0;
  double normalised = 0;
  double claimed = 0;
  for (const PairMean& pair : pairs) {
    frames.insert(pair.first);
    frames.insert(pair.second);
    const Matrix2<double> covariance = pair_covariance(pair, pair, motion, parameters);
    const Matrix2<double> L = covariance.llt().matrixL();
    whiten.push_back(L.inverse());
    squares += pair.residual.squaredNorm();
    claimed += covariance.trace();
    normalised += (whiten.back() * pair.residual).squaredNorm();
  }
  double correlations = 0;
  for (std::size_t a = 0; a < pairs.size(); ++a) {
    for (std::size_t b = 0; b < pairs.size(); ++b) {
      correlations += (whiten[a] * pair_covariance(pairs[a], pairs[b], motion, parameters) *
                       whiten[b].transpose())
                          .squaredNorm();
    }
  }
  const double numbers = 2.0 * out.pairs;
  out.frames = static_cast<int>(frames.size());
  out.freedom = numbers * numbers / (correlations * motion_inflation);
  out.rms_px = std::sqrt(squares / out.pairs);
  out.rms_deg = out.rms_px / focal_length * 180 / kPi;
  out.claimed_px = std::sqrt(claimed / out.pairs);
  out.ratio = std::sqrt(normalised / numbers);
  constexpr double kTwoSided95 = 1.959964;
  out.low = out.ratio * std::sqrt(out.freedom / chi_square_at(kTwoSided95, out.freedom));
  out.high = out.ratio *
             std::sqrt(out.freedom / std::max(1e-12, chi_square_at(-kTwoSided95, out.freedom)));
  out.log_chance = internal::log_chance(out.freedom * out.ratio * out.ratio, out.freedom);
  return out;
}

}  // namespace alidade

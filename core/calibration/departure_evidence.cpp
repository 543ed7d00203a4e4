#include "core/calibration/departure_evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/model/angle.h"

namespace alidade::internal {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Finer ones bend more between two knots than the interpolation follows. Knots.
constexpr double kShortestCurve = 1.5;
constexpr double kShortestRipple = 5;
constexpr double kLongestCurve = 2;  // of all knots
// Of all knots. What turns more slowly is hardly more than a bend, which tells no period: a curve.
constexpr double kLongestRipple = 1.25;

MatrixXd ripple_root(const DeparturePart& part, double period) {
  MatrixXd root(part.count, 2);
  for (Index i = 0; i < part.count; ++i) {
    const double phase = 2 * kPi * static_cast<double>(i) / period;
    root.row(i) << std::cos(phase), std::sin(phase);
  }
  return root;
}

// What the data say of one part, all that is present beside it eliminated, too.
struct PartData {
  MatrixXd S;
  VectorXd g;
};

// R of a curve's own rows with amplitude 1.
MatrixXd curve_root(const DeparturePart& part, double length) {
  constexpr double kNegligible = 1e-10;
  const Index knots = part.count;
  MatrixXd K(knots, knots);
  for (Index i = 0; i < knots; ++i) {
    for (Index j = 0; j < knots; ++j) {
      auto apart = static_cast<double>(i - j);
      if (part.closed) {  // by the chord, which keeps K positive
        const double turn = static_cast<double>(knots) / kPi;
        apart = turn * std::sin(apart / turn);
      }
      K(i, j) = std::exp(-0.5 * apart * apart / (length * length));
    }
  }
  // Cholesky with the largest pivot first, until nothing is left.
  MatrixXd root = MatrixXd::Zero(knots, knots);
  VectorXd left = K.diagonal();
  Index rank = 0;
  for (; rank < knots; ++rank) {
    Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    if (!(largest > kNegligible)) break;
    root.col(rank) = (K.col(pivot) - root.leftCols(rank) * root.row(pivot).head(rank).transpose()) /
                     std::sqrt(largest);
    left -= root.col(rank).cwiseAbs2();
  }
  return root.leftCols(rank);
}

// R of all parts that are present, but for one.
MatrixXd joint_root(const std::vector<DeparturePart>& parts,
                    const std::vector<DeparturePrior>& priors, const MatrixXd& sure, Index rows,
                    std::size_t without) {
  MatrixXd root = sure;
  if (root.rows() == 0) root.resize(rows, 0);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i == without || !(priors[i].amplitude > 0)) continue;
    const MatrixXd next = prior_root(parts[i], priors[i], rows);
    root.conservativeResize(Eigen::NoChange, root.cols() + next.cols());
    root.rightCols(next.cols()) = next;
  }
  return root;
}

PartData eliminate_others(const MatrixXd& S, const VectorXd& g, const MatrixXd& root,
                          const DeparturePart& part) {
  PartData out;
  out.S = S.block(part.first, part.first, part.count, part.count);
  out.g = g.segment(part.first, part.count);
  if (root.cols() == 0) return out;
  const MatrixXd SR = S * root;
  MatrixXd M = root.transpose() * SR;
  M.diagonal().array() += 1;
  const Eigen::LLT<MatrixXd> llt(M);
  const MatrixXd rows = SR.middleRows(part.first, part.count);
  out.S -= rows * llt.solve(rows.transpose());
  out.g -= rows * llt.solve(root.transpose() * g);
  return out;
}

// Log evidence of amplitude A over 0: M = R^T S R and z = R^T g of amplitude 1.
double gain_of(const MatrixXd& M, const VectorXd& z, double A) {
  MatrixXd B = A * A * M;
  B.diagonal().array() += 1;
  const Eigen::LLT<MatrixXd> llt(B);
  if (llt.info() != Eigen::Success) return 0;
  const VectorXd half = llt.matrixL().solve(z);
  return 0.5 * A * A * half.squaredNorm() - llt.matrixLLT().diagonal().array().log().sum();
}

DeparturePrior best_number(const PartData& data) {
  const double S = data.S(0, 0);
  const double g = data.g[0];
  DeparturePrior best;
  if (!(S > 0) || !(g > 0)) return best;
  const double z2 = g * g / S;
  if (z2 <= 1) return best;
  return {std::sqrt((z2 - 1) / S), 0, 0.5 * (z2 - 1 - std::log(z2))};
}

// Raises the gain from *at by factors of `step`, then of its roots down to `finest`.
template <class Gain>
void climb(double step, double finest, double least, double largest, Gain gain, double* at,
           double* best) {
  while (step > finest) {
    for (const double factor : {step, 1 / step}) {
      for (;;) {
        const double next = *at * factor;
        if (next < least || next > largest) break;
        const double there = gain(next);
        if (!(there > *best)) break;
        *best = there;
        *at = next;
      }
    }
    step = std::sqrt(step);
  }
}

MatrixXd root_of_shape(const DeparturePart& part, double length) {
  switch (part.shape) {
    case DepartureShape::kCurve:
      return curve_root(part, length);
    case DepartureShape::kRipple:
      return ripple_root(part, length);
    case DepartureShape::kNumber:
      break;
  }
  return MatrixXd::Ones(1, 1);
}

// The best amplitude of one length.
DeparturePrior best_amplitude(const PartData& data, const DeparturePart& part, double length,
                              double start) {
  constexpr double kStep = 2;
  constexpr double kFinest = 1.15;
  constexpr double kLeast = 1e-3;  // of the unit
  const MatrixXd root = root_of_shape(part, length);
  const MatrixXd M = root.transpose() * data.S * root;
  const VectorXd z = root.transpose() * data.g;
  DeparturePrior prior{std::min(start, part.largest), length, 0};
  prior.gain = gain_of(M, z, prior.amplitude);
  climb(
      kStep, kFinest, kLeast * part.unit, part.largest, [&](double A) { return gain_of(M, z, A); },
      &prior.amplitude, &prior.gain);
  return prior;
}

// Of these lengths, then between them.
DeparturePrior best_shape(const PartData& data, const DeparturePart& part,
                          const std::vector<double>& lengths, double step, double finest) {
  DeparturePrior best;
  const auto try_length = [&](double length) {
    const DeparturePrior prior =
        best_amplitude(data, part, length, best.amplitude > 0 ? best.amplitude : part.unit);
    if (prior.gain > best.gain) best = prior;
    return prior.gain;
  };
  for (const double length : lengths) static_cast<void>(try_length(length));
  if (!(best.gain > 0) || lengths.empty()) return best;
  double at = best.length;
  double gain = best.gain;
  climb(std::sqrt(step), finest, std::min(lengths.front(), lengths.back()),
        std::max(lengths.front(), lengths.back()), try_length, &at, &gain);
  return best;
}

// Not one whose period would rather be longer.
bool is_ripple(const DeparturePrior& prior, const DeparturePart& part) {
  constexpr double kAtTheEdge = 0.99;
  return prior.length < kAtTheEdge * kLongestRipple * static_cast<double>(part.count - 1);
}

// The curve on the same knots as a ripple.
std::size_t curve_beside(const std::vector<DeparturePart>& parts, std::size_t ripple) {
  std::size_t i = 0;
  while (parts[i].shape != DepartureShape::kCurve || parts[i].first != parts[ripple].first) ++i;
  return i;
}

DeparturePrior best_prior(const PartData& data, const DeparturePart& part) {
  constexpr double kCurveStep = 1.8;
  constexpr double kFinestCurve = 1.1;
  constexpr double kFinestRipple = 1.0001;
  constexpr double kRippleStep = 0.25;  // in periods over all knots
  std::vector<double> lengths;
  const auto knots = static_cast<double>(part.count - 1);
  switch (part.shape) {
    case DepartureShape::kCurve:
      if (kShortestCurve <= knots) lengths.push_back(kShortestCurve);
      while (!lengths.empty() && lengths.back() * kCurveStep <= knots) {
        lengths.push_back(lengths.back() * kCurveStep);
      }
      return best_shape(data, part, lengths, kCurveStep, kFinestCurve);
    case DepartureShape::kRipple: {
      for (double periods = 1 / kLongestRipple; periods * kShortestRipple <= knots;
           periods += kRippleStep) {
        lengths.push_back(knots / periods);
      }
      const DeparturePrior best = best_shape(data, part, lengths, 1 + kRippleStep, kFinestRipple);
      return is_ripple(best, part) ? best : DeparturePrior{};
    }
    case DepartureShape::kNumber:
      break;
  }
  return best_number(data);
}

// M = I + R^T S R
MatrixXd joint_matrix(const MatrixXd& S, const MatrixXd& root) {
  MatrixXd M = root.transpose() * S * root;
  M.diagonal().array() += 1;
  return M;
}

// Of all that a root describes, over nothing. *mean: of c.
double log_evidence(const MatrixXd& S, const VectorXd& g, const MatrixXd& root, VectorXd* mean) {
  const Eigen::LLT<MatrixXd> llt(joint_matrix(S, root));
  const VectorXd z = root.transpose() * g;
  const VectorXd x = llt.solve(z);
  *mean = root * x;
  return 0.5 * z.dot(x) - llt.matrixLLT().diagonal().array().log().sum();
}

// What the ripples' periods, which the evidence tells with an error of their own, add to the
// covariance of c: D V D^T, D = d mean / d log period, V^-1 = -d^2 log evidence (Kass, Steffey
// 1989).
MatrixXd covariance_of_periods(const MatrixXd& S, const VectorXd& g,
                               const std::vector<DeparturePart>& parts,
                               const std::vector<DeparturePrior>& priors, const MatrixXd& sure) {
  constexpr double kLargest = 0.2;  // of log period
  constexpr double kSmallest = 1e-4;
  const Index rows = g.size();
  MatrixXd out = MatrixXd::Zero(rows, rows);
  std::vector<std::size_t> ripples;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].shape == DepartureShape::kRipple && priors[i].amplitude > 0) ripples.push_back(i);
  }
  const auto count = static_cast<Index>(ripples.size());
  if (count == 0) return out;
  VectorXd mean;
  const auto evidence_at = [&](const VectorXd& log_change) {
    std::vector<DeparturePrior> there = priors;
    for (Index i = 0; i < count; ++i)
      there[ripples[static_cast<std::size_t>(i)]].length *= std::exp(log_change[i]);
    return log_evidence(S, g, joint_root(parts, there, sure, rows, parts.size()), &mean);
  };
  const double here = evidence_at(VectorXd::Zero(count));
  // Steps at which the evidence falls by about 1/2.
  VectorXd step(count);
  MatrixXd D(rows, count);
  MatrixXd bend(count, count);
  for (Index i = 0; i < count; ++i) {
    double second = 0;
    step[i] = kSmallest;
    for (;;) {
      const double above = evidence_at(step[i] * VectorXd::Unit(count, i));
      D.col(i) = mean;
      const double below = evidence_at(-step[i] * VectorXd::Unit(count, i));
      D.col(i) = (D.col(i) - mean) / (2 * step[i]);
      second = 2 * here - above - below;
      if (second >= 1 || step[i] >= kLargest) break;
      step[i] *= 2;
    }
    bend(i, i) = std::max(second / (step[i] * step[i]), 1 / (kLargest * kLargest));
  }
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < i; ++j) {
      const VectorXd a = step[i] * VectorXd::Unit(count, i);
      const VectorXd b = step[j] * VectorXd::Unit(count, j);
      const double mixed =
          evidence_at(a + b) + evidence_at(-a - b) - evidence_at(a - b) - evidence_at(b - a);
      bend(i, j) = bend(j, i) = -mixed / (4 * step[i] * step[j]);
    }
  }
  const Eigen::LLT<MatrixXd> llt(bend);
  // Far from a maximum only what each period says for itself is certain.
  const MatrixXd V = llt.info() == Eigen::Success
                         ? MatrixXd(llt.solve(MatrixXd::Identity(count, count)))
                         : MatrixXd(bend.diagonal().cwiseInverse().asDiagonal());
  out = D * V * D.transpose();
  return out;
}

}  // namespace

bool DepartureFit::any() const {
  return std::any_of(priors.begin(), priors.end(),
                     [](const DeparturePrior& prior) { return prior.amplitude > 0; });
}

MatrixXd prior_root(const DeparturePart& part, const DeparturePrior& prior, Index rows) {
  const MatrixXd own = root_of_shape(part, prior.length);
  MatrixXd root = MatrixXd::Zero(rows, own.cols());
  root.middleRows(part.first, part.count) = prior.amplitude * own;
  return root;
}

std::vector<DeparturePrior> choose_departures(const MatrixXd& information, const VectorXd& score,
                                              const std::vector<DeparturePart>& parts,
                                              const MatrixXd& sure, double least_gain) {
  constexpr int kSweeps = 2;
  std::vector<DeparturePrior> priors(parts.size());
  const auto best_of = [&](std::size_t i) {
    const MatrixXd others = joint_root(parts, priors, sure, score.size(), i);
    return best_prior(eliminate_others(information, score, others, parts[i]), parts[i]);
  };
  const auto is_present = [&](std::size_t i) { return priors[i].amplitude > 0; };
  const auto has_rival = [&](std::size_t i) {
    return parts[i].rival >= 0 && is_present(static_cast<std::size_t>(parts[i].rival));
  };
  const auto may_join = [&](std::size_t i, bool with_curves) {
    return parts[i].count > 0 && !is_present(i) && !has_rival(i) &&
           (with_curves || parts[i].shape != DepartureShape::kCurve);
  };
  // One by one, what the data show most clearly first. A curve explains what is simpler, too: it
  // comes after.
  const auto add = [&](bool with_curves) {
    std::size_t best_part = 0;
    DeparturePrior best;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!may_join(i, with_curves)) continue;
      const DeparturePrior prior = best_of(i);
      if (!(prior.gain > best.gain)) continue;
      best = prior;
      best_part = i;
    }
    if (best.gain < least_gain) return false;
    priors[best_part] = best;
    return true;
  };
  for (const bool with_curves : {false, true}) {
    while (add(with_curves)) continue;
  }
  // What one explains the other need not.
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!is_present(i)) continue;
      priors[i] = {};
      const DeparturePrior own = best_of(i);
      if (parts[i].rival >= 0) {
        const auto rival = static_cast<std::size_t>(parts[i].rival);
        const DeparturePrior other = best_of(rival);
        if (other.gain > std::max(own.gain, least_gain)) {
          priors[rival] = other;
          continue;
        }
      }
      if (own.gain >= least_gain) priors[i] = own;
    }
  }
  return priors;
}

void refine_departures(const MatrixXd& information, const VectorXd& score,
                       const std::vector<DeparturePart>& parts, const MatrixXd& sure,
                       std::vector<DeparturePrior>* priors) {
  constexpr int kSweeps = 3;
  constexpr double kStep = 1.02;
  constexpr double kFinest = 1.0001;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      DeparturePrior& prior = (*priors)[i];
      if (parts[i].shape != DepartureShape::kRipple || !(prior.amplitude > 0)) continue;
      const PartData data = eliminate_others(
          information, score, joint_root(parts, *priors, sure, score.size(), i), parts[i]);
      const auto knots = static_cast<double>(parts[i].count - 1);
      DeparturePrior best;
      const auto try_length = [&](double length) {
        const DeparturePrior there = best_amplitude(data, parts[i], length, prior.amplitude);
        if (there.gain > best.gain) best = there;
        return there.gain;
      };
      double length = prior.length;
      double gain = try_length(length);
      climb(kStep, kFinest, kShortestRipple, kLongestRipple * knots, try_length, &length, &gain);
      if (best.gain > 0) prior = best;
      if (is_ripple(prior, parts[i])) continue;
      prior = {};
      const std::size_t curve = curve_beside(parts, i);
      if ((*priors)[curve].amplitude > 0) continue;
      (*priors)[curve] = best_prior(
          eliminate_others(information, score,
                           joint_root(parts, *priors, sure, score.size(), curve), parts[curve]),
          parts[curve]);
    }
  }
}

DeparturePrior possible_curve(const MatrixXd& information, const VectorXd& score,
                              const std::vector<DeparturePart>& parts,
                              const std::vector<DeparturePrior>& priors, const MatrixXd& sure,
                              std::size_t part, double amplitude) {
  constexpr double kStep = 1.3;
  const PartData data = eliminate_others(
      information, score, joint_root(parts, priors, sure, score.size(), part), parts[part]);
  double length = kLongestCurve * static_cast<double>(parts[part].count - 1);
  DeparturePrior best;
  while (length >= kShortestCurve) {
    const MatrixXd root = curve_root(parts[part], length);
    const double gain =
        gain_of(root.transpose() * data.S * root, root.transpose() * data.g, amplitude);
    if (!(best.amplitude > 0) || gain > best.gain) best = {amplitude, length, gain};
    length /= kStep;
  }
  return best;
}

DepartureFit fit_departures(const MatrixXd& information, const VectorXd& score,
                            const std::vector<DeparturePart>& parts,
                            std::vector<DeparturePrior> priors, const MatrixXd& sure) {
  DepartureFit fit;
  fit.priors = std::move(priors);
  fit.mean.setZero(score.size());
  fit.covariance.setZero(score.size(), score.size());
  const MatrixXd root = joint_root(parts, fit.priors, sure, score.size(), parts.size());
  if (root.cols() == 0) return fit;
  // P = R M^-1 R^T
  const Eigen::LLT<MatrixXd> llt(joint_matrix(information, root));
  const MatrixXd half = llt.matrixL().solve(root.transpose());
  fit.covariance = half.transpose() * half;
  fit.mean = fit.covariance * score;
  fit.unknowns = fit.covariance.cwiseProduct(information).sum();
  fit.covariance += covariance_of_periods(information, score, parts, fit.priors, sure);
  return fit;
}

}  // namespace alidade::internal

#pragma once
// Evidence and posterior of departures from the model: of additional linear parameters c, with all
// other parameters eliminated. No new adjustment is needed.
//   log p(data | c) = g^T c - c^T S c / 2 + const      g score, S information (positive
//                                                      semidefinite): s and N of departure_score.h
//   c ~ N(0, K)      log evidence = g^T P g / 2 - log det(I + K S) / 2,  P = (S + K^-1)^-1 = cov(c)
// K is made of parts, each present or not:
//   curve    A^2 exp(-(i - j)^2 / (2 L^2)) on knots i, j: any smooth error. closed: i - j is the
//            chord of a circle on which the knots lie
//   ripple   A^2 cos(2 pi (i - j) / L) on knots: a sine of any phase, as a gear's
//   number   A^2
// The evidence chooses parts, A and L (type-II likelihood). K may be singular, so its root R is
// used, K = R R^T. A has the unit of c, L counts knots. Allocates. Derivation: docs/calibration.md.

#include <Eigen/Core>
#include <vector>

namespace alidade::internal {

enum class DepartureShape { kCurve, kRipple, kNumber };

// Acts on the elements first to first + count - 1 of c. Parts may share elements.
struct DeparturePart {
  DepartureShape shape = DepartureShape::kNumber;
  Eigen::Index first = 0;
  Eigen::Index count = 1;  // knots; 0: never present. 1 for a number, which must come out positive
  bool closed = false;     // curve: the last knot's neighbour is the first
  double unit = 1;         // in the unit of c: the search for A begins here; least A: 1e-3 of it
  double largest = 1e3;    // in the unit of c: the largest A; neither limit holds for a number
  // Index of a part that is never present together with this one; each names the other. -1: none.
  int rival = -1;
};

// What was chosen for one part.
struct DeparturePrior {
  double amplitude = 0;  // A; 0: the part is absent
  double length = 0;     // L, in knots; 0: a number
  double gain = 0;       // in log evidence, over the part's absence
};

struct DepartureFit {
  std::vector<DeparturePrior> priors;  // for each part
  Eigen::VectorXd mean;                // of c; zero where neither a present part nor `sure` acts
  Eigen::MatrixXd covariance;          // of c; likewise
  double unknowns = 0;                 // trace(P S): how many numbers the data determine

  [[nodiscard]] bool any() const;  // a part is present
};

// Log evidence that a part must gain to be present. Chance then shows a part in fewer than one of a
// hundred recordings without any departure.
inline constexpr double kLeastGain = 7;

// R of one part, with its amplitude. rows: the size of c.
[[nodiscard]] Eigen::MatrixXd prior_root(const DeparturePart& part, const DeparturePrior& prior,
                                         Eigen::Index rows);

// Chooses the parts that are present, with A and L; one result for each part. Curves are tried
// last. information, score (here and below): S and g. sure (likewise): the root R of what is
// present in any case, as many rows as c; empty: nothing is.
[[nodiscard]] std::vector<DeparturePrior> choose_departures(const Eigen::MatrixXd& information,
                                                            const Eigen::VectorXd& score,
                                                            const std::vector<DeparturePart>& parts,
                                                            const Eigen::MatrixXd& sure,
                                                            double least_gain = kLeastGain);

// Moves A and L of the ripples that are present to the nearest maximum of the evidence. A ripple
// whose period becomes too long to be told from a bend is removed; the curve with the same `first`,
// which must be among the parts, gets its likeliest prior unless it is present already.
void refine_departures(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                       const std::vector<DeparturePart>& parts, const Eigen::MatrixXd& sure,
                       std::vector<DeparturePrior>* priors);

// The prior of parts[part], which must be a curve, with this amplitude and the likeliest length. It
// need not gain evidence: `gain` may be negative. Absent if the curve has too few knots.
[[nodiscard]] DeparturePrior possible_curve(const Eigen::MatrixXd& information,
                                            const Eigen::VectorXd& score,
                                            const std::vector<DeparturePart>& parts,
                                            const std::vector<DeparturePrior>& priors,
                                            const Eigen::MatrixXd& sure, std::size_t part,
                                            double amplitude);

// The posterior with these priors and with `sure`. The covariance includes the errors of the
// ripples' periods.
[[nodiscard]] DepartureFit fit_departures(const Eigen::MatrixXd& information,
                                          const Eigen::VectorXd& score,
                                          const std::vector<DeparturePart>& parts,
                                          std::vector<DeparturePrior> priors,
                                          const Eigen::MatrixXd& sure);

}  // namespace alidade::internal

#pragma once
// What the data say of departures from the model, before they are adjusted for: evidence and
// posterior of additional linear parameters c, all others eliminated.
//   log p(data | c) = g^T c - c^T S c / 2 + const      g score, S information
//   c ~ N(0, K)      log evidence = g^T P g / 2 - log det(I + K S) / 2,  P = (S + K^-1)^-1 = cov(c)
// K is made of parts, each present or not:
//   curve    A^2 exp(-(i - j)^2 / 2 L^2) on knots i, j: any smooth error
//   ripple   A^2 cos(2 pi (i - j) / L) on knots: a sine of any phase, as a gear's
//   number   A^2
// Parts and their A and L are chosen by the evidence (type-II likelihood); a part has to pay for
// itself and for the choice. Roots K = R R^T are used, as K may be singular. Allocates.
// Derivation: docs/calibration.md.

#include <Eigen/Core>
#include <vector>

namespace alidade::internal {

enum class DepartureShape { kCurve, kRipple, kNumber };

// Of c, columns first to first + count - 1. Parts may share them.
struct DeparturePart {
  DepartureShape shape = DepartureShape::kNumber;
  Eigen::Index first = 0;
  Eigen::Index count = 1;  // knots; a number, which must come out positive, has 1
  bool closed = false;     // the last knot's neighbour is the first
  double unit = 1;         // an amplitude that the data may well show or not
  double largest = 1e3;    // amplitude; more than the data show comes from chance
  int rival = -1;          // a part that describes the same and is not present together with it
};

struct DeparturePrior {
  double amplitude = 0;  // A; 0: the part is absent
  double length = 0;     // L, in knots
  double gain = 0;       // in log evidence, over the part's absence
};

struct DepartureFit {
  std::vector<DeparturePrior> priors;  // for each part
  Eigen::VectorXd mean;                // of c; zero where no part is present
  Eigen::MatrixXd covariance;
  double unknowns = 0;  // trace(P S): of how many numbers the data determine c

  [[nodiscard]] bool any() const;
};

// Log evidence that a part has to gain: with less, in one of some hundred recordings without any
// departure one would be found.
inline constexpr double kLeastGain = 7;

// R of a part alone, as many rows as c.
[[nodiscard]] Eigen::MatrixXd prior_root(const DeparturePart& part, const DeparturePrior& prior,
                                         Eigen::Index rows);

// Chooses what is present. sure: K of what is present in any case (empty: nothing), as a root.
[[nodiscard]] std::vector<DeparturePrior> choose_departures(const Eigen::MatrixXd& information,
                                                            const Eigen::VectorXd& score,
                                                            const std::vector<DeparturePart>& parts,
                                                            const Eigen::MatrixXd& sure,
                                                            double least_gain = kLeastGain);

// Raises the evidence by the A and L of the ripples that are present, near where they are.
void refine_departures(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                       const std::vector<DeparturePart>& parts, const Eigen::MatrixXd& sure,
                       std::vector<DeparturePrior>* priors);

// A curve of a size that is known, with the likeliest length, whatever it gains.
[[nodiscard]] DeparturePrior possible_curve(const Eigen::MatrixXd& information,
                                            const Eigen::VectorXd& score,
                                            const std::vector<DeparturePart>& parts,
                                            const std::vector<DeparturePrior>& priors,
                                            const Eigen::MatrixXd& sure, std::size_t part,
                                            double amplitude);

// The posterior with these priors, and whatever else is in `sure`. Ripples' periods have errors.
[[nodiscard]] DepartureFit fit_departures(const Eigen::MatrixXd& information,
                                          const Eigen::VectorXd& score,
                                          const std::vector<DeparturePart>& parts,
                                          std::vector<DeparturePrior> priors,
                                          const Eigen::MatrixXd& sure);

}  // namespace alidade::internal

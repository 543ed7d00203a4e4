#pragma once
// TelemetryDepartures: what telemetry reads besides the scaled angle, noise and steps, by axis:
//   measured = scale angle + g(angle) + play     (core/model/telemetry_error.h, play.h)
// The values of g at its knots and the width of the play are linear parameters; they act on the
// telemetry's residuals only. The evidence (departure_evidence.h) says whether they are present,
// how large and how smooth. Their posterior mean is subtracted from the readings, and their
// posterior covariance adds to the covariance of all parameters. Angles rad. Allocates. Derivation:
// docs/calibration.md.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/departure_evidence.h"
#include "core/calibration/linearisation.h"
#include "core/model/telemetry_error.h"

namespace alidade::internal {

class TelemetryDepartures {
 public:
  // fixed: as given to Adjustment. resolution: the step of the readings; 0: none. accuracy: the
  // standard deviation that the maker claims for each axis's angles; 0: no claim.
  explicit TelemetryDepartures(const std::array<bool, kGlobalCount>& fixed, double resolution = 0,
                               double accuracy = 0)
      : fixed_(fixed), resolution_(resolution), accuracy_(accuracy) {}

  // Estimates all departures anew, not as a change of the latest estimate. data: the same samples
  // in all calls, with the latest estimate subtracted by subtract(). state, at: a minimum for
  // `data`, robust or of least squares. choose: chooses the parts that are present; must be true in
  // the first call. Otherwise the parts stay, and only ripples are refined (departure_evidence.h).
  // False if no part is present and no accuracy is claimed, or if the normal equations have no
  // solution: the estimate is then not to be subtracted.
  [[nodiscard]] bool estimate(const AdjustmentData& data, const AdjustmentState& state,
                              const Linearisation& at, bool choose, Adjustment* adjustment);

  // After estimate(). Sets the readings to the original ones minus the departures. Sets the sigmas
  // to the original ones, larger where the state of the play is not known.
  void subtract(const AdjustmentState& state, const Linearisation& at, AdjustmentData* data);

  // To be called when the adjustment begins to take this parameter (index in GlobalVector) as
  // exact.
  void hold(int parameter) { fixed_[static_cast<std::size_t>(parameter)] = true; }

  // To be called when the readings' sigmas in the data were multiplied by this.
  void scale_noise(double ratio);

  // Difference of the latest estimate from what was subtracted before it, in standard deviations.
  [[nodiscard]] double change() const { return change_; }
  // The number of unknowns that the telemetry determines here.
  [[nodiscard]] double unknowns() const { return fit_.unknowns; }
  // To be added to the parameters' covariance; scaled as in linearisation.h.
  [[nodiscard]] const GlobalMatrix& covariance() const { return covariance_; }
  // The errors as last estimated.
  [[nodiscard]] TelemetryError error() const;

 private:
  static constexpr int kRipples = 2;
  static constexpr int kKinds = 2;
  static constexpr std::array<PlayKind, kKinds> kKind = {PlayKind::kMotor, PlayKind::kOutput};

  // The part of the reading that is play, for one kind of play.
  struct PlayColumn {
    double ahead = 0;   // rad, at the present width
    double slope = 0;   // d ahead / d width
    double unsure = 0;  // rad, sigma of `ahead`: the state of the play is not known
  };
  struct Columns {  // of one reading of one axis
    CurveWeights curve;
    std::array<PlayColumn, kKinds> play;
  };
  struct Normal {  // of the departures c, all other unknowns eliminated
    Eigen::MatrixXd S;
    Eigen::VectorXd g;              // at c = 0
    Eigen::MatrixXd of_parameters;  // d parameters / d c
  };

  void begin(const AdjustmentData& data, const AdjustmentState& state);
  // Sets the largest amplitude of each part: 5 times the RMS of the residuals before any departure
  // was subtracted.
  void limit_amplitudes(const AdjustmentData& data, const AdjustmentState& state,
                        const Linearisation& at);
  void find_columns(const AdjustmentData& data, const AdjustmentState& state,
                    const Linearisation& at);
  void find_play(const AdjustmentData& data, const AdjustmentState& state, const Linearisation& at,
                 int axis);
  [[nodiscard]] bool eliminate(const AdjustmentData& data, const AdjustmentState& state,
                               const Linearisation& at, Adjustment* adjustment, Normal* out) const;
  [[nodiscard]] Eigen::MatrixXd claim() const;
  // g of one axis as a straight line, rad over all knots, one standard deviation.
  void add_slope(int axis, double rise, Eigen::MatrixXd* root) const;
  // Where g is a curve of no period, its bend hardly determines its slope.
  void add_possible_slopes(Eigen::MatrixXd* sure) const;
  // g of both axes may have a slope: the choice must not assume that the other axis has none.
  [[nodiscard]] Eigen::MatrixXd with_slopes(const Eigen::MatrixXd& sure) const;
  // If one axis has an error of some size, the other one may have such an error, too. If that is
  // slow, it shows no more than a bend.
  void add_possible_curves(const Normal& normal, const Eigen::MatrixXd& sure);
  // If an axis has an error of some size, it may have play of that size, too. Slow movements do not
  // tell play from the clock offset.
  void add_possible_play(Eigen::MatrixXd* sure) const;
  // Parts of c: for each axis a curve, ripples on its knots, then play of each kind.
  [[nodiscard]] static std::size_t curve_part(int axis) {
    return static_cast<std::size_t>(axis * (1 + kRipples + kKinds));
  }
  [[nodiscard]] static std::size_t play_part(int axis, int kind) {
    return curve_part(axis) + 1 + kRipples + static_cast<std::size_t>(kind);
  }
  [[nodiscard]] bool is_present(std::size_t part) const {
    return !fit_.priors.empty() && fit_.priors[part].amplitude > 0;
  }
  [[nodiscard]] double value(std::size_t part) const { return fit_.mean[parts_[part].first]; }
  // g at a reading.
  [[nodiscard]] double curve_at(const Columns& columns, int axis) const;

  std::array<bool, kGlobalCount> fixed_;
  double resolution_;
  double accuracy_;
  std::vector<Vector2<double>> measured_;  // as read
  std::vector<Vector2<double>> sigma_;
  Vector2<double> typical_sigma_ = Vector2<double>::Ones();
  std::array<AngleErrorCurve, 2> knots_{};  // without values
  std::vector<DeparturePart> parts_;
  std::vector<std::array<Columns, 2>> columns_;
  DepartureFit fit_;
  Eigen::VectorXd subtracted_;  // fit_.mean as it was
  double change_ = 0;
  GlobalMatrix covariance_ = GlobalMatrix::Zero();
};

}  // namespace alidade::internal

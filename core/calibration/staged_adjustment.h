#pragma once
// StagedAdjustment: fifth stage of calibrate(), the adjustment (adjustment.h) from rough start
// values to the final covariance. Allocates; one object for each recording.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/centre_share.h"
#include "core/calibration/depth_spread.h"
#include "core/calibration/drifting_tracks.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/stage_status.h"
#include "core/calibration/start_values.h"
#include "core/calibration/telemetry_departures.h"

namespace alidade::internal {

// At the minimum of least squares. covariance: of the parameters, scaled as in linearisation.h.
struct Adjusted {
  AdjustmentState state;
  Linearisation at;
  GlobalMatrix covariance = GlobalMatrix::Zero();
  TelemetryError telemetry_error;
  std::optional<Nearness> nearness;  // of what is in view; empty: no scene was stated
};

class StagedAdjustment {
 public:
  // *selected must outlive this object, and only this object may change it: the adjustment removes
  // drifting landmarks from it, sets outliers, noise and crossings, and subtracts departures from
  // its telemetry.
  // nearness_sigma: of the prior of each landmark's nearness (AdjustmentState); 0: none has any.
  StagedAdjustment(const StartValues& start, const TelemetryAngleNoise& noise,
                   const CalibrationOptions& options, double nearness_sigma,
                   SelectedInput* selected);

  // Cauchy loss, whose scale follows the medians of the residuals, down to 3 sigmas. Splits
  // segments of the spline if the residuals ask for it (knot_choice.h). Leaves out what drifts
  // (drifting_tracks.h). Begins anew if anything does, and to add nearness. Then replaces rounded
  // telemetry by its crossings (rounded_telemetry.h), which need a trajectory that is already
  // close. Subtracts the departures that telemetry shows (telemetry_departures.h). Marks outliers
  // at the end.
  void adjust_robustly();

  // After adjust_robustly(). Least squares on the rest, as a robust loss on good data would inflate
  // the sigmas; outliers are marked again. Noise levels that the residuals contradict are replaced
  // by theirs (noise_check.h). The covariance grows by errors that observations share
  // (shared_errors.h), contradictions between parts (contradictions.h), their causes (departures.h)
  // and what all distances have in common (common_nearness.h); the optical centre is held meanwhile
  // (centre_share.h). Refuses: kTelemetryMismatch (drift, or errors that no gear has), kWeak
  // (undetermined), kNotConverged, kBadInput (the pictures contradict the stated scene). Sets
  // steps, ratios, repetition, contradiction and causes of *quality.
  [[nodiscard]] StageStatus adjust_on_inliers(CalibrationQuality* quality);

  // After adjust_on_inliers() returned ok.
  [[nodiscard]] const Adjusted& adjusted() const { return adjusted_; }
  // If different distances are the likeliest cause that adjust_on_inliers() found, the standard
  // deviation of the landmarks' nearness; else, and if nearness_sigma is not 0: 0.
  [[nodiscard]] double seen_nearness() const { return seen_nearness_; }
  // The number of observations that were left out because they drift.
  [[nodiscard]] int drifting() const { return drifting_; }

 private:
  [[nodiscard]] bool settle_robustly();
  [[nodiscard]] bool leave_out_drifting();
  [[nodiscard]] DriftingTracks find_drifting_without(const std::vector<char>& drifts);
  void give_nearness();
  [[nodiscard]] bool settle_on_inliers();
  [[nodiscard]] bool settle_departures();
  [[nodiscard]] bool settle_known_departures();
  bool split_knots();
  void replace_rounded_telemetry();
  bool mark_outliers();
  bool correct_noise(CalibrationQuality* quality);
  [[nodiscard]] bool hold_centre();
  void release_centre();
  [[nodiscard]] StageStatus allow_for_repetition(CalibrationQuality* quality);
  void allow_for_shared_errors();
  void allow_for_contradictions(CalibrationQuality* quality);
  void allow_for_common_nearness();

  SelectedInput* selected_;
  TelemetryAngleNoise noise_;
  int max_knots_;
  double centre_sigma_px_;  // prior
  std::string doubt_;
  Adjustment adjustment_;
  TelemetryDepartures departures_;
  bool departs_ = false;  // telemetry has departures
  Adjusted adjusted_;
  AdjustmentState start_;
  double telemetry_unknowns_ = 0;
  CentreShare<kGlobalCount> centre_;
  Mechanics<double> axes_held_;                      // in whose tangent bases centre_ is
  GlobalMatrix centre_held_ = GlobalMatrix::Zero();  // covariance before it grew
  GlobalMatrix hidden_ = GlobalMatrix::Zero();       // Departures::hidden
  bool settled_ = false;                             // by settle_robustly()
  DriftFinding drift_ = DriftFinding::kNone;
  double drift_px_s_ = 0;
  int drifting_ = 0;  // observations
  double nearness_sigma_;
  double seen_nearness_ = 0;
  Pupil pupil_;
  std::optional<SceneDistance> scene_;
  DepthSpread depth_;  // shown by the pictures; 0: nothing
};

}  // namespace alidade::internal

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
  // *selected must outlive this object. The adjustment sets outliers, noise and crossings in it and
  // subtracts departures from its telemetry.
  // nearness_sigma: of the prior of each landmark's nearness (AdjustmentState); 0: none has any.
  StagedAdjustment(const StartValues& start, const TelemetryAngleNoise& noise,
                   const CalibrationOptions& options, double nearness_sigma,
                   SelectedInput* selected);

  // Cauchy loss, whose scale follows the medians of the residuals, down to 3 sigmas. Splits
  // segments of the spline if the residuals ask for it (knot_choice.h). Leaves out what drifts, and
  // begins anew if anything does (drifting_tracks.h). Then replaces rounded telemetry by its
  // crossings (rounded_telemetry.h), which need a trajectory that is already close. Subtracts the
  // departures that telemetry shows (telemetry_departures.h). Marks outliers at the end.
  void adjust_robustly();

  // Least squares on the rest, as a robust loss on good data would inflate the sigmas. Outliers are
  // marked again. Noise levels that the residuals contradict beyond chance are replaced by the
  // residuals' (noise_check.h). The covariance grows if residuals move the parameters together
  // (shared_errors.h), and if parts of the recording contradict each other (contradictions.h); the
  // optical centre is held meanwhile (centre_share.h). The focal length's share grows by what all
  // distances have in common (common_nearness.h); a stated scene that the pictures contradict is
  // bad input. Sets the quality's steps, ratios, repetition and contradiction. After
  // adjust_robustly().
  [[nodiscard]] StageStatus adjust_on_inliers(CalibrationQuality* quality);

  // After adjust_on_inliers() returned ok.
  [[nodiscard]] const Adjusted& adjusted() const { return adjusted_; }
  // What adjust_on_inliers() saw of different distances, where nearness_sigma is 0; 0: nothing.
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
  Mechanics<double> axes_held_;                      // whose tangent bases centre_ is told in
  GlobalMatrix centre_held_ = GlobalMatrix::Zero();  // covariance before it grew
  GlobalMatrix hidden_ = GlobalMatrix::Zero();       // Departures
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

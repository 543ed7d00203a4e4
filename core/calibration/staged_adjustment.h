#pragma once
// Fifth stage of calibrate(): the adjustment (adjustment.h), from afar to close by.
//   adjust_robustly     Cauchy loss, its scale from the residuals' medians down to 3 sigmas; the spline's segments are
//                       split where the residuals ask for it (knot_choice.h). Rounded telemetry is then replaced by its
//                       crossings (rounded_telemetry.h): readings hold a trajectory everywhere, crossings only from
//                       close by. Outliers are marked by what comes out.
//   adjust_on_inliers   least squares on the rest, outliers marked anew; noise levels that the residuals contradict
//                       beyond chance are replaced by the residuals' (noise_check.h); covariance, grown where
//                       residuals move the parameters together (shared_errors.h). A robust loss on good data would
//                       inflate the sigmas that are reported.
// Allocates; one object for each recording.

#include <string>

#include "core/calibration/adjustment.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/stage_status.h"
#include "core/calibration/start_values.h"

namespace alidade::internal {

// At the minimum of least squares.
struct Adjusted {
  AdjustmentState state;
  Linearisation at;
  GlobalMatrix covariance = GlobalMatrix::Zero();
};

class StagedAdjustment {
 public:
  // selected must outlive it: outliers, noise and crossings are set there.
  StagedAdjustment(const StartValues& start, const TelemetryNoise& noise, int max_knots,
                   SelectedInput* selected);

  void adjust_robustly();

  // Sets the quality's steps, ratios and repetition.
  [[nodiscard]] StageStatus adjust_on_inliers(CalibrationQuality* quality);

  [[nodiscard]] const Adjusted& adjusted() const { return adjusted_; }

 private:
  [[nodiscard]] bool settle_robustly();
  [[nodiscard]] bool settle_on_inliers();
  bool split_knots();
  void replace_rounded_telemetry();
  bool mark_outliers();
  bool correct_noise(CalibrationQuality* quality);
  [[nodiscard]] StageStatus allow_for_repetition(CalibrationQuality* quality);
  void allow_for_shared_errors();

  SelectedInput* selected_;
  TelemetryNoise noise_;
  int max_knots_;
  std::string doubt_;
  Adjustment adjustment_;
  Adjusted adjusted_;
  double telemetry_unknowns_ = 0;
  bool settled_ = false;  // robustly
};

}  // namespace alidade::internal

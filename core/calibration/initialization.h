#pragma once
// First values for the adjustment, from the data alone.
//   telemetry  unwrapped, and smoothed by a cubic spline fitted with redescending weights
//   d and f    over ~0.5 s the image moves by (-f cos(tilt) dpan, f dtilt): d is where the median motion of the
//              tracks correlates best with the telemetry's, f is the ratio there. Medians and the normalised
//              correlation need neither a guess of f nor clean tracks.
//   landmarks  medians of the observations' directions under the telemetry's orientation
// Small tilt and nominal axes are assumed: good to some percent, which the robust adjustment removes. Allocates.

#include <optional>
#include <vector>

#include "core/calibration/adjustment.h"

namespace alidade::internal {

// Angles made continuous (each within half a turn of the median of those before it).
void unwrap(std::vector<AdjustmentTelemetry>* telemetry);

// A spline through the samples at time_s - shift_s, with knots about spacing_s apart where there are samples. *sigma
// (if not null) is the robust standard deviation of the residuals. Nothing if there are too few samples.
[[nodiscard]] std::optional<TrajectorySpline> fit_telemetry(
    const std::vector<AdjustmentTelemetry>& telemetry, double shift_s, double begin_s, double end_s,
    double spacing_s, double* sigma = nullptr);

// The median motion of the tracks from one frame to another, px.
struct ImageMotion {
  double from_s = 0;
  double to_s = 0;
  Vector2<double> shift;
};

// Over baselines of about baseline_s, along chains of frames that share landmarks.
[[nodiscard]] std::vector<ImageMotion> image_motion(const AdjustmentData& data, double baseline_s);

struct MotionMatch {
  double shift_s = 0;  // telemetry time = image time + shift_s
  double focal_length = 0;
  double correlation = 0;  // of the motions, 1 = perfect
  bool at_edge = false;
};

[[nodiscard]] MotionMatch match_motion(const std::vector<ImageMotion>& motion,
                                       const TrajectorySpline& telemetry, double centre_s,
                                       double half_range_s);

// The step between neighbouring readings if angles come in whole steps, otherwise 0.
[[nodiscard]] double angle_quantum(const std::vector<AdjustmentTelemetry>& telemetry);

// The noise of each sample: white noise, the rounding to whole quanta, and the stamp's own error, at the
// smoothed rate.
void set_telemetry_sigma(double white_sigma, double quantum, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry);

// What telemetry in whole quanta says without the bias of its rounding. Where an axis moves less than two quanta
// from sample to sample, rounding errors are no noise: readings stay off to one side while it turns round. But
// between two neighbouring readings it passed half-way between them: that is added, as a sample at the middle of
// their times with the uncertainty of the moment (trajectory time = telemetry time - shift_s). All equal readings in
// a row together keep the weight of one with a sigma of a quantum: enough to hold what nothing else holds.
// source[i]: index of the sample (the first of the two) that gave item i. Noise of a quarter quantum or more
// dithers the readings: they stay as they are.
[[nodiscard]] std::vector<AdjustmentTelemetry> quantum_crossings(
    const std::vector<AdjustmentTelemetry>& telemetry, double quantum, double white_sigma,
    const TrajectorySpline& trajectory, double shift_s, std::vector<std::size_t>* source);

// Landmarks in the frame of the anchor, from the state's camera, mount and trajectory.
void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state);

}  // namespace alidade::internal

#pragma once
// calibrate_pattern(): line delay and lens, with covariance, from a video of a known pattern taken
// by a moving camera (Oth et al., 2013). Intrinsics and distortion are estimated together with the
// line delay, which goes beyond the paper. Start: lens and poses as if all rows were exposed at
// once. Repeatedly: adjust curve and lens, reject wrong detections, estimate the noise of the
// others, split the curve where residuals ask for it. Last: least squares on the inliers. A pattern
// larger or smaller than named is not noticed: lens and line delay stay the same, positions and
// distances scale. A stretched or bent pattern shows by the misfit. Batch work: allocates; touches
// no file.

#include <string>
#include <vector>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pose_curve.h"

namespace alidade {

enum class PatternStatus {
  kOk,
  kBadInput,         // sizes, indices, times or numbers contradict pattern_data.h
  kNoPattern,        // no frame shows the pattern
  kTooFewFrames,     // too few frames show the pattern, or these show too few points of it
  kNoStart,          // the views do not determine a lens, even roughly
  kNotConverged,     // no poses, or no curve, explain the detections
  kFrameRateTooLow,  // the curve cannot follow the motion
  kNoLineDelay,      // the pattern or, during the read-out, the image hardly moved
  kNoLens,           // a focal length is too uncertain: similar views, or a bent pattern
};

struct PatternCalibrationOptions {
  LensKnowledge known;
  double start_line_delay_s = 0;  // s/row; start value, any sign; unless the line delay is fixed
  // Largest standard deviation of line delay * height; beyond it the motion was not enough.
  double largest_readout_sigma_s = 5e-4;
  // Largest relative standard deviation of a focal length; beyond it the views were not enough.
  // Errors of simulated views were up to 1.9 sigmas for sigmas of 0.4 to 0.8 %, and up to 7 for 1
  // to 2 %.
  double largest_focal_length_sigma = 0.008;
};

// If status is not kOk, the members other than status and message may be incomplete.
struct PatternCalibration {
  PatternStatus status = PatternStatus::kBadInput;
  std::string message;               // if refused: one line, what is wrong and what would help
  std::vector<std::string> remarks;  // if not refused: one line each, what is worth knowing

  LensVector lens = LensVector::Zero();
  LensMatrix covariance = LensMatrix::Zero();  // in LensParameter's units; 0 for a fixed one
  PoseCurve curve;                      // the camera in the pattern's frame, times as the data's
  double sigma_px = 0;                  // of a detection's coordinate, from the residuals
  double residual_rms_px = 0;           // of a coordinate
  int observations = 0;                 // used
  int left_out = 0;                     // wrong detections, or those that cannot be projected
  int frames = 0;                       // with used observations
  double frame_interval_s = 0;          // median
  int rounds = 0;                       // of splitting the curve
  std::vector<std::vector<char>> used;  // by frame and observation

  // One standard deviation, in the parameter's unit.
  [[nodiscard]] double sigma(LensParameter parameter) const;
  // Whether the line delay is 0 within three sigmas.
  [[nodiscard]] bool has_global_shutter() const;
};

[[nodiscard]] PatternCalibration calibrate_pattern(const PatternData& data,
                                                   const PatternCalibrationOptions& options = {});

// Projected minus observed, in the order of frames and observations; without those that cannot be
// projected.
struct PatternResidual {
  int frame = 0;
  int observation = 0;
  Vector2<double> error;  // px
};
[[nodiscard]] std::vector<PatternResidual> pattern_residuals(const PatternData& data,
                                                             const LensVector& lens,
                                                             const PoseCurve& curve);

}  // namespace alidade

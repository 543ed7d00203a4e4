#pragma once
// Line delay and lens from a video of a known pattern before a moving camera (Oth et al., 2013), with intrinsics, distortion
// and line delay estimated together, which the paper names as an open problem, and with their covariance.
//   start: lens and poses as if all rows were exposed at once, a curve through the poses
//   again and again: adjust curve and lens together, leave out wrong detections, estimate the detections' noise, split the curve
//   where residuals ask for it; then once more on what is left, by least squares
// What nothing in the data tells: a pattern that is larger or smaller than told in all directions. Lens and line delay are the
// same then, positions and distances as much too small or too large. One that is stretched or bent is noticed by its misfit.
// Batch work: it allocates. It touches no file.

#include <string>
#include <vector>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pose_curve.h"

namespace alidade {

enum class PatternStatus {
  kOk,
  kBadInput,         // sizes, indices, times or numbers are not what pattern_data.h says
  kNoPattern,        // no frame shows enough of the pattern
  kTooFewFrames,     // or too short
  kNoStart,          // the views determine no lens, not even roughly
  kNotConverged,     // no curve explains the detections
  kFrameRateTooLow,  // for the motion: the curve cannot follow it
  kNoLineDelay,      // the image hardly moved while it was read out
  kNoLens,           // views too much alike
};

struct PatternCalibrationOptions {
  LensKnowledge known;
  double start_line_delay_s = 0;  // where the search begins, any sign
  double largest_readout_sigma_s =
      5e-4;  // standard deviation of line delay * height beyond which the motion was not enough
  // Relative, beyond which the views were not enough: of simulated ones errors were up to 1.9 sigmas of 0.4 to 0.8 %, and up to 7 of
  // 1 to 2 %.
  double largest_focal_length_sigma = 0.008;
};

struct PatternCalibration {
  PatternStatus status = PatternStatus::kBadInput;
  std::string message;               // one line, if refused: what is wrong and what would help
  std::vector<std::string> remarks;  // one line each, if not: what is worth knowing of it

  LensVector lens = LensVector::Zero();
  LensMatrix covariance = LensMatrix::Zero();  // in LensParameter's units; 0 for what was fixed
  PoseCurve curve;                      // the camera in the pattern's frame, times as the data's
  double sigma_px = 0;                  // of a detection's coordinate, from the residuals
  double residual_rms_px = 0;           // of a coordinate
  int observations = 0;                 // used
  int left_out = 0;                     // wrong detections, or none that fits
  int frames = 0;                       // with observations that were used
  double frame_interval_s = 0;          // median
  int rounds = 0;                       // of splitting the curve
  std::vector<std::vector<char>> used;  // by frame and observation

  [[nodiscard]] double sigma(LensParameter parameter) const;
  // The line delay is 0 within three sigmas.
  [[nodiscard]] bool has_global_shutter() const;
};

[[nodiscard]] PatternCalibration calibrate_pattern(const PatternData& data,
                                                   const PatternCalibrationOptions& options = {});

// Residuals, px: projected minus observed, in the order of frames and observations; empty where the model sees none.
struct PatternResidual {
  int frame = 0;
  int observation = 0;
  Vector2<double> error;  // px
};
[[nodiscard]] std::vector<PatternResidual> pattern_residuals(const PatternData& data,
                                                             const LensVector& lens,
                                                             const PoseCurve& curve);

}  // namespace alidade

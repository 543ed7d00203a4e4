#pragma once
// OE mode on a rendered recording, held against its truth: for a grid of pixels of every frame, each at
// its own row's time, where the estimate says that the pixel looks, and where it did.
//
//   error (px) = focal length * angle between the two, along the image's u and v, in the optical centre's
//   pixels; normalised square = xi' C^-1 xi of the same error with the covariance C that came with it.
//
// Telemetry is looked up with all samples known (as in replay), at the time the calibration in use says.
// A second pass shows the same frames again, the path having come back to its beginning, with the map
// that the first one made: then only the second counts.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "core/realtime/oe_mode/oe_mode.h"
#include "test/accuracy/oe_recordings.h"
#include "test/accuracy/rendered_recording.h"
#include "test/accuracy/statistics.h"

namespace alidade::test {

inline constexpr int kGridColumns = 9;
inline constexpr int kGridRows = 5;
inline constexpr int kGridPoints = kGridColumns * kGridRows;
inline constexpr int kWarmUpFrames = 10;  // not judged: the map is being filled

struct PointError {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // estimate minus truth, along u and v
  Eigen::Vector2d whitened = Eigen::Vector2d::Zero();
  [[nodiscard]] double normalised_square() const { return whitened.squaredNorm(); }
};
using GridErrors = std::array<PointError, kGridPoints>;

struct FrameEvaluation {
  int frame = 0;
  double time_s = 0;
  OrientationMode mode = OrientationMode::kNone;
  OeStatistics statistics;
  GridErrors errors;    // nothing is known if the mode is none
  double sigma_px = 0;  // claimed for the image centre: root of the mean variance of the two axes
  double process_s = 0;
  double maintain_s = 0;

  // Of the recording, whatever was estimated.
  bool pt_known = false;  // there was telemetry
  GridErrors pt_errors;
  // Change of each point's error (px) with pan and tilt (rad).
  std::array<Eigen::Matrix2d, kGridPoints> J_angle;
  // What the best orientation with constant rates would leave, px.
  std::array<Eigen::Vector2d, kGridPoints> constant_rate_px;
  double speed = 0;         // largest of the rows, horizontal fields of view a second
  double acceleration = 0;  // fields of view / s^2, in the middle of the frame
};

// How patch alignment did, of one octave: seen against the truth. Edges, which are known in one direction
// only, are counted and left out of the rest.
struct OctaveEvaluation {
  int observations = 0;
  int inliers = 0;
  int edges = 0;               // of the inliers
  double residual_rms_px = 0;  // length
  double claimed_rms_px = 0;   // root of the mean trace of their covariance
  // How those of one landmark scatter about their mean, by the truth; length, px.
  double scatter_rms_px = 0;
};

struct Evaluation {
  std::vector<FrameEvaluation> frames;  // of the last pass
  std::array<OctaveEvaluation, LandmarkMap::kMaxOctaves> octaves;
  int map_size = 0;
  std::size_t memory_bytes = 0;
};

struct EvaluationOptions {
  OeOptions oe;
  int passes = 1;
  const Disturbance* disturbance = nullptr;
  // Called after process(), before maintain(), for each frame of the last pass.
  std::function<void(int frame, const cv::Mat& image, const OeMode& oe)> look;
};

[[nodiscard]] Evaluation evaluate(const RenderedRecording& recording,
                                  const std::vector<cv::Mat>& images,
                                  const Calibration& calibration, const EvaluationOptions& options);

// Errors (px) of all frames from kWarmUpFrames on that have an orientation, one vector a grid point.
struct ErrorSet {
  std::vector<Eigen::Vector2d> px;
  std::vector<const FrameEvaluation*> frame;
  std::vector<int> point;
};
[[nodiscard]] ErrorSet errors_of(const Evaluation& evaluation);
[[nodiscard]] ErrorSet pt_errors_of(const Evaluation& evaluation);
[[nodiscard]] ErrorSet constant_rate_errors_of(const Evaluation& evaluation);
// The errors in the map's frame: the estimated offset between map and telemetry undone.
[[nodiscard]] ErrorSet map_errors_of(const Evaluation& evaluation);
// What is left when the one change of pan and tilt that explains most is taken away from all.
[[nodiscard]] ErrorSet without_common_offset(ErrorSet errors);
[[nodiscard]] double rms(const ErrorSet& errors);  // of the length

// Mean of the normalised square, per degree of freedom: 1 is honest. Frames (and more so a frame's points)
// are correlated: `independent` is how many independent frames would tell as much,
//   n / (1 + 2 sum_k (1 - k / n) rho_k^2), rho_k the correlation of whitened errors k frames apart,
// and the interval (95 %) is chi-square's for two degrees of freedom of each of these.
struct Honesty {
  double nees = 0;
  double independent = 0;
  Interval interval;
  double worst_sigmas = 0;  // largest root of a normalised square
  int frames = 0;
  int beyond_five_sigmas = 0;  // frames with a point beyond five
};
[[nodiscard]] Honesty honesty_of(const std::vector<const FrameEvaluation*>& frames);
[[nodiscard]] std::vector<const FrameEvaluation*> frames_between(const Evaluation& evaluation,
                                                                 double from_s, double to_s);

}  // namespace alidade::test

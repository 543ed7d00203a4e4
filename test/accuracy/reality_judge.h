#pragma once
// The yardsticks of alidade_reality: a calibration and the records of a replay against the virtual
// camera's truth. It has its own readers of the program's files, so that it can judge any version.
//
//   calibration   e = truth - estimate of the kJudged parameters, C its covariance: e^T C^-1 e / 8
//   frame         e = truth - estimate of where the picture's middle looks at the frame's time
//                 (row 0), along u and v; C from the orientation's covariance: e^T C^-1 e / 2
// Conventions of the truth:
//   focal length    its mean over the film if it breathes
//   clock offset    of the earliest stamps (docs/simulator.md); play, steps and noise reduction do
//                   not change it
//   base            where the telemetry's zero would be without the gear's error. An estimator that
//                   cannot know this must say so in its sigmas. `relative` errors are without one
//                   common rotation of the base
//   optical centre  without an estimate of it the camera frame goes through the picture's middle;
//                   the truth is converted to that camera frame and to the base that belongs to it
//   mast            directions are in the world

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "test/accuracy/statistics.h"
#include "test/simulator/camera_model.h"

namespace alidade::test {

// The names in calibration.yaml's covariance. Axes: rad, in the tangent basis of the estimate
// (PTCEE 9).
inline constexpr std::array<const char*, 8> kJudged = {
    "focal_length", "radial_distortion", "line_delay",  "pan_axis_0",
    "pan_axis_1",   "tilt_axis_0",       "tilt_axis_1", "clock_offset"};
inline constexpr int kJudgedCount = static_cast<int>(kJudged.size());
using JudgedVector = Eigen::Matrix<double, kJudgedCount, 1>;
using JudgedMatrix = Eigen::Matrix<double, kJudgedCount, kJudgedCount>;

// calibration.yaml, of what is judged.
struct FoundCalibration {
  double focal_length = 0, radial_distortion = 0, line_delay = 0, clock_offset = 0;
  double aspect = 1;
  Eigen::Vector3d pan_axis, tilt_axis;
  Eigen::Vector2d centre_offset{Eigen::Vector2d::Zero()};  // px
  bool centre_estimated = false;
  JudgedMatrix covariance = JudgedMatrix::Zero();
};
// Throws std::runtime_error.
[[nodiscard]] FoundCalibration read_found_calibration(const std::filesystem::path& file);

struct FoundOrientation {
  int frame = -1;
  bool oe = false;
  Eigen::Matrix3d R_base_from_camera;
  Eigen::Matrix3d covariance;  // rad^2, of R Exp(xi)
};
// A line of `alidade replay --json`; nothing in mode none. Throws std::runtime_error.
[[nodiscard]] std::optional<FoundOrientation> read_found_orientation(const std::string& line);

struct FrameError {
  int frame = -1;
  bool oe = false;
  Eigen::Vector2d px;                              // truth - estimate, along u and v
  Eigen::Matrix2d covariance;                      // px^2
  Eigen::Matrix<double, 2, 3> J_rotation;          // of px, with a rotation of the base; px/rad
  [[nodiscard]] double normalised_square() const;  // e' C^-1 e / 2
  [[nodiscard]] double sigma_px() const;           // of the length: root of the trace
};

class RealityTruth {
 public:
  explicit RealityTruth(const simulator::Config& config);

  [[nodiscard]] JudgedVector calibration_error(const FoundCalibration& found) const;
  // Frame i begins at i / rate.
  [[nodiscard]] FrameError frame_error(const FoundCalibration& found,
                                       const FoundOrientation& orientation) const;
  [[nodiscard]] double focal_length() const { return config_.camera.focal_length; }

 private:
  // From the truth's base and camera frame to those of the estimate.
  struct Gauge {
    Eigen::Matrix3d base, camera;
  };
  [[nodiscard]] Gauge gauge_of(const FoundCalibration& found) const;

  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  simulator::CameraModel camera_;
};

// Of a recording: without the rotation of the base that fits best.
[[nodiscard]] std::vector<FrameError> without_common_rotation(std::vector<FrameError> errors);

struct SeedResult {
  std::uint64_t seed = 0;
  std::string refusal;  // why there is no calibration, or no replay
  std::optional<JudgedVector> error;
  JudgedMatrix covariance = JudgedMatrix::Zero();
  int frames = 0;
  std::vector<FrameError> frame_errors;
};

// Of the seeds that were calibrated.
struct CalibrationStatistics {
  int seeds = 0;
  double anees = 0;  // of e' C^-1 e / 8
  Interval chance;   // 99.9 %
  int beyond = 0;    // values of more than kBeyondSigmas
  double worst_sigmas = 0;
  std::string worst;  // its name
};
inline constexpr double kBeyondSigmas = 4.5;
[[nodiscard]] CalibrationStatistics calibration_statistics(const std::vector<SeedResult>& seeds);

// Of the frames in OE mode, unless stated.
struct ReplayStatistics {
  int frames = 0;               // all
  int answered = 0;             // with an orientation, in any mode
  int oe = 0;                   // in OE mode
  double nees = 0;              // mean of e^T C^-1 e / 2
  double worst = 0;             // the largest of these, in any mode
  double sigma_over_error = 0;  // median sigma_px over rms_px
  double rms_px = 0;            // of e
  double relative_px = 0;       // rms of e without a common rotation
  double pt_nees = 0;           // of the frames in PT mode
};
[[nodiscard]] ReplayStatistics replay_statistics(const std::vector<SeedResult>& seeds);

// One line for each mark that is missed. Nothing that was not measured is missed.
[[nodiscard]] std::vector<std::string> missed_marks(const CalibrationStatistics& calibration,
                                                    const ReplayStatistics& replay,
                                                    std::optional<double> most_relative);

// Checks the yardsticks: known errors must give the known statistics, and sigmas of half the size
// must be noticed. Returns one line that says what is wrong; empty: nothing.
[[nodiscard]] std::string yardsticks_fault();

}  // namespace alidade::test

#pragma once
// DriftFit: the adjustment, linearised once, in which chosen landmarks l drift at a constant rate
// w_l (pan, tilt; rad/s) about their mean time t_l:
//   error = J_angle p(t) + J_camera g + J_landmark d_l + J_angle w_l (t - t_l) + noise.
// A landmark's image moves as if the camera turned at w_l: the landmark itself turns at -w_l.
// Solved for are the changes p of the trajectory, g of the parameters, d_l of the directions, and
// the rates. Telemetry and priors count as in the adjustment, so a drift is against telemetry.
// Observations that fit no drift count less, as in telemetry_fit.h. The drift of a landmark may
// also be known, as a part of a group. Times s on the image clock. Allocates.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

enum class TrackMotion : char {
  kFree,    // a drift of its own
  kAtRest,  // none
  kShared   // the group's, which is known
};

class DriftFit {
 public:
  // One landmark, about its mean time. covariance and normal: with trajectory and parameters as
  // known; the rate has a prior of 0 +- 0.01 rad/s.
  struct Track {
    double begin_s = 0;
    double middle_s = 0;  // mean time
    double end_s = 0;
    int observations = 0;                                  // that are used here
    Vector2<double> rate = Vector2<double>::Zero();        // w_l; 0 with less than 2 observations
    Matrix2<double> covariance = Matrix2<double>::Zero();  // of the rate, by the track's own noise
    // Normal equations of (d_l, w_l): right-hand side, matrix, and rows of the unknowns in common.
    Vector4<double> gradient = Vector4<double>::Zero();
    Matrix4<double> normal = Matrix4<double>::Zero();
    std::vector<int> points;  // control points that it touches
    Eigen::MatrixXd cross;    // two rows for each of these, then those of the camera
  };

  // Uses outliers, too: `used` of the data is changed during the call and restored. From 60,000
  // observations on, only those of every second frame are used; from 120,000 on, those of every
  // third, and so on. state: near the minimum. Keeps no reference to the arguments.
  DriftFit(AdjustmentData* data, const AdjustmentState& state, Adjustment* adjustment);

  // Solves with these motions, one for each landmark. shared_rate: w_l of those with kShared. Then
  // sets the rate that each track would have if it were free, with trajectory and parameters as
  // solved. *cost: the weighted sum of squares at the minimum minus that of zero unknowns. False:
  // there is no minimum; the tracks stay.
  [[nodiscard]] bool solve(const std::vector<TrackMotion>& motions,
                           const Vector2<double>& shared_rate, double* cost);

  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }  // by landmark

 private:
  struct Row {
    int landmark = 0;
    double time_s = 0;
    TrajectorySpline::Basis basis;
    Vector2<double> error;
    Matrix2<double> J_angle;
    Matrix2<double> J_landmark;
    Eigen::Matrix<double, 2, kObservedCount> J_camera;
    double weight = 1;
  };

  void find_tracks();
  void form_equations();
  // Weights by what is left at the latest solution.
  void weigh();
  [[nodiscard]] Vector4<double> landmark_solution(const Track& track) const;

  std::array<bool, kGlobalCount> fixed_;
  Eigen::MatrixXd known_;  // normal matrix of telemetry and priors
  Eigen::VectorXd known_gradient_;
  std::vector<Row> rows_;  // by landmark
  std::vector<Track> tracks_;
  Eigen::MatrixXd normal_;  // all but the landmarks
  Eigen::VectorXd gradient_;
  Eigen::VectorXd solution_;
  double noise_square_ = 1;  // variance of what is left, in units of the stated one; at least 1
};

}  // namespace alidade::internal

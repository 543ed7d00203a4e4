#pragma once
// DriftFit: the adjustment, linearised once, in which chosen landmarks l drift at a constant rate
// w_l of (pan, tilt) about their mean time t_l:
//   error = J_angle p(t) + J_camera g + J_landmark d_l + J_angle w_l (t - t_l) + noise.
// Trajectory p, parameters g, landmarks d_l and rates are solved for. Telemetry and priors count as
// in the adjustment: a drift is against telemetry. Observations that fit no drift count less, as in
// telemetry_fit.h. A landmark may also have a known drift, as a part of a group. Times s on the
// image clock, rates rad/s. Allocates.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

enum class TrackMotion : char {
  kFree,    // a drift of its own
  kAtRest,  // none
  kShared   // the group's
};

class DriftFit {
 public:
  // One landmark. Its rate and equations hold for given trajectory and parameters.
  struct Track {
    double begin_s = 0;
    double middle_s = 0;  // mean time
    double end_s = 0;
    int observations = 0;                                  // 0: none is in use
    Vector2<double> rate = Vector2<double>::Zero();        // of (pan, tilt)
    Matrix2<double> covariance = Matrix2<double>::Zero();  // of the rate, by the track's own noise
    Vector4<double> gradient = Vector4<double>::Zero();    // of (d_l, w_l), in `normal`'s terms
    Matrix4<double> normal = Matrix4<double>::Zero();
    std::vector<int> points;  // control points
    Eigen::MatrixXd cross;    // rows: points, then camera
  };

  // Uses outliers, too; the marks of the data stay. Of more than some ten thousand observations,
  // only those of every second frame, or third, and so on, are used. state: near the minimum.
  // Borrows nothing after the call.
  DriftFit(AdjustmentData* data, const AdjustmentState& state, Adjustment* adjustment);

  // Solves with these motions, one of each landmark, and sets the rate that each track would have if
  // it were free. *cost: the sum of squares at the minimum minus that of zero unknowns. False: there
  // is no minimum.
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
  Eigen::MatrixXd known_;  // of telemetry and priors
  Eigen::VectorXd known_gradient_;
  std::vector<Row> rows_;  // by landmark
  std::vector<Track> tracks_;
  Eigen::MatrixXd normal_;  // all but the landmarks
  Eigen::VectorXd gradient_;
  Eigen::VectorXd solution_;
  double noise_square_ = 1;  // of what is left, where 1 is as stated
};

}  // namespace alidade::internal

#pragma once
// MovementAdjustment: bundle adjustment of one movement of the zoom (zoom_movement.h). Minimised is
//   sum |A^-1 (u - pi(R(p(t + v l))^T d; f, k, c at t + v l))|^2 / sigma_px^2      A as in linearisation.h, f's rate in it
// + sum |wrap(measured - scale p)|^2 / sigma_rad^2
// + sum |n_i|^2 / sigma_i^2    of what distortion and centre have beside the curve, at places along the movement
// over splines of pan, tilt and log f, n and directions d. Robustly first, then by least squares on what is left. Of the unknowns
// come the control points' pan and tilt, then log f of the first rest, of the second, of the control points between, then n.
// Allocates.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/calibration/linearisation.h"
#include "core/calibration/zoom_stretches.h"
#include "core/model/cubic_spline.h"
#include "core/model/zoom_curve.h"

namespace alidade::internal {

// Pan, tilt (rad, true) and log f over time.
class ZoomMotionSpline : public CubicSpline<3, ZoomMotionSpline> {
 public:
  using CubicSpline::CubicSpline;
};

struct MovementData {
  AdjustmentData input;             // frames' times, tracks, telemetry with unwrapped angles
  std::vector<ZoomReading> passed;  // image clock, from the first rest's last to the second's first
  double begin_s = 0;               // image clock, of what is looked at
  double rest_ends_s = 0;           // until then f is that of the first rest
  double rest_begins_s = 0;         // from then on that of the second
  double end_s = 0;
  double frame_period_s = 0;
  double pan_tilt_sigma_rad = 0;  // 0: as the residuals have it
  int width = 0;                  // px
  int height = 0;
};

class MovementAdjustment {
 public:
  // curve gives the start, distortion and centre, and what is shared; it must outlive this.
  MovementAdjustment(MovementData data, const ZoomCurve& curve);

  // False and one line in *error: no minimum, or something is left undetermined.
  [[nodiscard]] bool run(std::string* error);

  [[nodiscard]] int unknowns() const { return unknowns_; }
  [[nodiscard]] int landmarks() const { return static_cast<int>(landmarks_.size()); }
  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] double begin_s() const { return spline_.begin_s(); }
  [[nodiscard]] double end_s() const { return spline_.end_s(); }

  // After run().
  [[nodiscard]] double log_f(double time_s) const { return spline_.value(basis(time_s))[2]; }
  [[nodiscard]] double log_f_rate(double time_s) const {
    return spline_.derivative(basis(time_s))[2];
  }
  // d log f / d unknowns.
  [[nodiscard]] Eigen::VectorXd log_f_row(double time_s) const;
  // Of the unknowns, residuals that are larger than they say accounted for.
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }
  [[nodiscard]] double pixel_sigma_ratio() const { return pixel_sigma_ratio_; }

 private:
  // Distortion and centre at a time, and how they go with n: a share of two neighbours.
  struct LensPlace {
    Vector3<double> quantities;  // corner distortion, centre
    int first = 0;
    double share = 0;  // of the second
  };
  // One residual: its two components by up to 18 unknowns and the landmark's two.
  struct Row {
    Vector2<double> error;
    std::vector<int> index;
    std::vector<Vector2<double>> J;
    Matrix2<double> J_landmark;
  };
  struct Normal {
    double cost = 0;
    bool valid = true;
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    std::vector<Matrix2<double>> H_landmark;
    std::vector<Vector2<double>> g_landmark;
    std::vector<std::vector<int>> touched;
    std::vector<std::vector<Vector2<double>>> H_touched;  // of the landmark by the unknown
    std::vector<double> pixel_square;  // of each observation, in its sigmas; negative: none
    double telemetry_square = 0;
    int telemetry_count = 0;
  };

  // Along the movement, of what distortion and centre have beside the curve.
  static constexpr int kPlaces = 5;
  static int point_row(int control_point) { return 2 * control_point; }

  [[nodiscard]] ZoomMotionSpline::Basis basis(double time_s) const { return spline_.basis(time_s); }
  // Between which two readings, and the second's share; before and after all of them the first and the last.
  struct Passing {
    std::size_t second;
    double share;
  };
  [[nodiscard]] Passing passing_at(double time_s) const;
  [[nodiscard]] LensPlace lens_at(double time_s) const;
  [[nodiscard]] Camera<double> camera_at(double log_f, const LensPlace& lens) const;
  // k of a unit of corner distortion.
  [[nodiscard]] double per_corner_at(double focal_length) const;
  // Where log f and n begin among the unknowns.
  [[nodiscard]] int first_log_f() const { return 2 * spline_.control_points(); }
  [[nodiscard]] int first_beside() const { return first_log_f() + log_f_unknowns_; }
  [[nodiscard]] int log_f_unknown(int control_point) const;
  void set_places();
  void set_start();
  void set_landmarks();
  [[nodiscard]] bool observe(const AdjustmentObservation& seen, Row* row) const;
  void linearise(double loss_px, bool with_derivatives, Normal* out) const;
  [[nodiscard]] bool solve(const Normal& normal, double damping, Eigen::VectorXd* x,
                           std::vector<Vector2<double>>* x_landmark) const;
  [[nodiscard]] bool reduce(const Normal& normal, double damping, Eigen::MatrixXd* H,
                            Eigen::VectorXd* g) const;
  void apply(const Eigen::VectorXd& x, const std::vector<Vector2<double>>& x_landmark);
  void minimise(double loss_px, int max_steps, Normal* at);
  void mark_outliers(const Normal& at);

  MovementData data_;
  const ZoomCurve& curve_;
  Calibration shared_;
  ZoomMotionSpline spline_;
  std::vector<int> log_f_unknown_;  // of each control point, from 0
  int log_f_unknowns_ = 0;
  // Along the movement: times, readings' share of the way, distortion and centre of the curve there.
  std::vector<double> way_time_s_;
  std::vector<double> way_share_;
  std::vector<Vector3<double>> way_quantities_;
  Eigen::Matrix3Xd beside_;        // n
  Eigen::Matrix3Xd beside_sigma_;  // of it
  std::vector<Vector3<double>> landmarks_;
  double telemetry_sigma_ = 0;
  int unknowns_ = 0;
  int frames_ = 0;
  Eigen::MatrixXd covariance_;
  double pixel_sigma_ratio_ = 0;
};

}  // namespace alidade::internal

#pragma once
// MovementAdjustment: bundle adjustment of one movement of the zoom (zoom_movement.h). It minimises
//   sum |A^-1 (u - pi(R(p(t + v l))^T d; f, k, c at t + v l))|^2 / sigma_px^2
// + sum |measured - scale p|^2 / sigma_rad^2           telemetry, unwrapped, with a robust loss
// + sum |n_i|^2 / sigma_i^2
// over splines of pan, tilt and log f (constant in each dwell), directions d (base), and n. n is
// the difference of distortion and centre from the curve's, at places along the movement; sigma_i
// is the curve's. A: as in linearisation.h, with f's rate in u'. Line delay, axes, scales, aspect
// and clock offset are fixed. The loss of observations is robust first, then least squares on the
// inliers. Allocates.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/calibration/linearisation.h"
#include "core/calibration/zoom_stretches.h"
#include "core/model/cubic_spline.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade::internal {

// Pan, tilt (rad, true) and log f over time.
class ZoomMotionSpline : public CubicSpline<3, ZoomMotionSpline> {
 public:
  using CubicSpline::CubicSpline;
};

struct MovementData {
  AdjustmentData input;  // frames' times, tracks, telemetry with unwrapped angles
  // Image clock; from the last reading of the first dwell to the first reading of the second dwell.
  std::vector<ZoomReading> passed;
  double begin_s = 0;        // image clock, as are the next three: the span that is used
  double rest_ends_s = 0;    // until then f is the first dwell's
  double rest_begins_s = 0;  // from then on f is the second dwell's
  double end_s = 0;
  double frame_period_s = 0;
  double pan_tilt_sigma_rad = 0;  // 0: estimated from the residuals
  int width = 0;                  // px
  int height = 0;
};

// Order of the unknowns: the control points' pan and tilt, log f of the first dwell, log f of the
// second dwell, log f of the control points between, n. Times on the image clock.
class MovementAdjustment {
 public:
  // curve: not empty; gives start values, distortion, centre and shared parameters. The curve must
  // outlive this object, and must not change.
  MovementAdjustment(MovementData data, const ZoomCurve& curve);

  // False and one line in *error: no landmark has a projection, too few tracks agree, or something
  // is left undetermined.
  [[nodiscard]] bool run(std::string* error);

  [[nodiscard]] int unknowns() const { return unknowns_; }
  // Counts of the tracks that came in and of the frames that they are in, outliers included.
  [[nodiscard]] int landmarks() const { return static_cast<int>(landmarks_.size()); }
  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] double begin_s() const { return spline_.begin_s(); }
  [[nodiscard]] double end_s() const { return spline_.end_s(); }

  // After run(), as all below. log f at a time.
  [[nodiscard]] double log_f(double time_s) const { return spline_.value(basis(time_s))[2]; }
  // 1/s.
  [[nodiscard]] double log_f_rate(double time_s) const {
    return spline_.derivative(basis(time_s))[2];
  }
  // d log f / d unknowns.
  [[nodiscard]] Eigen::VectorXd log_f_row(double time_s) const;
  // Covariance of the unknowns, enlarged if the residuals exceed their sigmas. Includes a weak
  // prior of each log f, of sigma 0.5.
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }
  // RMS of the residuals of observations and telemetry over their sigmas, by their redundancy. n is
  // not among them; a residual of telemetry counts as at most 3 sigmas.
  [[nodiscard]] double pixel_sigma_ratio() const { return pixel_sigma_ratio_; }

 private:
  // What n counts: distortion in the corner and centre, the quantities behind log f.
  static constexpr int kBeside = kZoomQuantityCount - index(ZoomQuantity::kCornerDistortion);
  using Beside = Matrix<double, kBeside, 1>;
  using BesideColumns = Matrix<double, kBeside, Eigen::Dynamic>;
  // Distortion and centre at a time. n is interpolated between two neighbouring places.
  struct LensPlace {
    Beside quantities;
    int first = 0;
    double share = 0;  // of the second
  };
  // One residual, with its derivatives by up to 18 unknowns and by the landmark's two.
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
    std::vector<double> pixel_square;  // residual^2 in sigma^2; negative: no projection
    double telemetry_square = 0;
    int telemetry_count = 0;
  };

  // Places along the movement at which n is estimated.
  static constexpr int kPlaces = 5;
  static int point_row(int control_point) { return 2 * control_point; }

  [[nodiscard]] ZoomMotionSpline::Basis basis(double time_s) const { return spline_.basis(time_s); }
  // The two readings around a time, and the second's share. Clamped at the ends.
  struct Passing {
    std::size_t second;
    double share;
  };
  [[nodiscard]] Passing passing_at(double time_s) const;
  [[nodiscard]] LensPlace lens_at(double time_s) const;
  [[nodiscard]] Camera<double> camera_at(double log_f, const LensPlace& lens) const;
  // Index of the first log f and of the first n among the unknowns.
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
  std::vector<int> log_f_unknown_;  // of each control point, relative to first_log_f()
  int log_f_unknowns_ = 0;
  // Along the movement: times, position between the end readings (0 to 1), the curve's distortion
  // and centre.
  std::vector<double> way_time_s_;
  std::vector<double> way_share_;
  std::vector<Beside> way_quantities_;
  BesideColumns beside_;        // n
  BesideColumns beside_sigma_;  // sigma of n
  std::vector<Vector3<double>> landmarks_;
  double telemetry_sigma_ = 0;
  int unknowns_ = 0;
  int frames_ = 0;
  Eigen::MatrixXd covariance_;
  double pixel_sigma_ratio_ = 0;
};

}  // namespace alidade::internal

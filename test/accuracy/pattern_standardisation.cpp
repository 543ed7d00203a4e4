#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/pattern/moving_projection.h"
#include "test/accuracy/pattern_paper.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

constexpr int kLineDelay = index(LensParameter::kLineDelay);

enum class Standardisation { kNone, kDerived, kAsPrinted };

// The paper's residual: the detection minus where the point is when the detection's own row is exposed (Oth 9), times the inverse
// of what maps the detection's noise onto it.
class MeasuredRowCost : public ceres::SizedCostFunction<2, 6, 6, 6, 6, 1> {
 public:
  MeasuredRowCost(const PoseCurve* curve, int segment, const LensVector& lens, double frame_time_s,
                  const Vector3<double>& p, const Vector2<double>& u, double sigma_px,
                  Standardisation standardisation, double line_delay_s)
      : curve_(curve), segment_(segment), lens_(lens), frame_time_s_(frame_time_s), p_(p), u_(u) {
    lens_[kLineDelay] = 0;  // the time is the detection's
    whitening_ = Matrix2<double>::Identity() / sigma_px;
    MovingProjection seen;
    Vector2<double> rate;
    if (standardisation == Standardisation::kNone ||
        !project(control_points_of(*curve, segment), line_delay_s, &seen, &rate)) {
      return;
    }
    Matrix2<double> A = Matrix2<double>::Identity();
    if (standardisation == Standardisation::kDerived) {
      A.col(1) -= line_delay_s * rate;
    } else {  // (Oth 18): both rows by the row's motion
      A.col(1) += Vector2<double>::Constant(line_delay_s * rate.y());
    }
    // Motion along the read-out as fast as it makes it singular.
    if (std::abs(A.determinant()) > 0.1) whitening_ = A.inverse() / sigma_px;
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    ControlPoints points;
    for (int i = 0; i < 4; ++i) points.col(i) = Eigen::Map<const PoseVector>(parameters[i]);
    MovingProjection seen;
    Vector2<double> rate;
    if (!project(points, parameters[4][0], &seen, &rate)) return false;
    Eigen::Map<Vector2<double>> out(residuals);
    out = whitening_ * (seen.u - u_);
    if (jacobians == nullptr) return true;
    for (int k = 0; k < 4; ++k) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[k]);
      J = whitening_ * seen.J_u_x * seen.basis.weight[k];
    }
    if (jacobians[4] != nullptr) {
      Eigen::Map<Vector2<double>> J(jacobians[4]);
      J = whitening_ * rate * u_.y();
    }
    return true;
  }

 private:
  bool project(const ControlPoints& points, double line_delay_s, MovingProjection* seen,
               Vector2<double>* rate) const {
    if (project_moving(*curve_, segment_, points, lens_, frame_time_s_ + u_.y() * line_delay_s, p_,
                       u_.y(), seen, true) != ProjectionStatus::kOk) {
      return false;
    }
    *rate = seen->J_u_x * (points * seen->basis.rate_weight);
    return true;
  }

  const PoseCurve* curve_;
  int segment_;
  LensVector lens_;
  double frame_time_s_;
  Vector3<double> p_;
  Vector2<double> u_;
  Matrix2<double> whitening_;
};

// Line delay and curve with the lens known, from where the calibration ended; the covariances made anew three times.
double line_delay_by(const PatternData& data, const PatternCalibration& start, double sigma_px,
                     Standardisation standardisation) {
  PoseCurve curve = start.curve;
  double line_delay_s = start.lens[kLineDelay];
  for (int round = 0; round < 3; ++round) {
    const PoseCurve spline = curve;
    ceres::Problem problem;
    int segment = 0;
    for (const PatternFrame& frame : data.frames) {
      for (const PatternObservation& observation : frame.observations) {
        segment = spline.segment_at(frame.time_s + observation.u.y() * line_delay_s, segment);
        problem.AddResidualBlock(
            new MeasuredRowCost(&spline, segment, start.lens, frame.time_s,
                                data.points_m[static_cast<std::size_t>(observation.point)],
                                observation.u, sigma_px, standardisation, line_delay_s),
            nullptr, curve.control_point(segment).data(), curve.control_point(segment + 1).data(),
            curve.control_point(segment + 2).data(), curve.control_point(segment + 3).data(),
            &line_delay_s);
      }
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.initial_trust_region_radius = 1e8;
    options.max_num_iterations = 10;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return std::numeric_limits<double>::quiet_NaN();
  }
  return line_delay_s;
}

}  // namespace

void print_standardisation(int recordings, std::uint64_t first_seed, std::ostream& out) {
  PatternScene scene;
  scene.rate_hz = 12;
  scene.lens.line_delay_s = 82.5e-6;
  scene.speed = 1.5;
  PatternCalibrationOptions options;
  options.known.mean = truth_of(scene.lens);
  options.known.fixed.fill(true);
  options.known.fixed[kLineDelay] = false;
  constexpr std::array<const char*, 4> kNames = {
      "the predicted row (ours)", "the measured row, none", "the measured row, as derived",
      "the measured row, as printed"};
  std::array<std::vector<double>, 4> errors_us;
  Table table;
  for (int i = 0; i < recordings; ++i) {
    scene.seed = first_seed + static_cast<std::uint64_t>(i);
    const PatternData data = simulate_pattern(scene);
    const PatternCalibration calibration = calibrate_pattern(data, options);
    if (calibration.status != PatternStatus::kOk) {
      table.notes.push_back("seed " + std::to_string(scene.seed) + ": " + calibration.message);
      continue;
    }
    const auto add = [&](std::size_t k, double line_delay_s) {
      errors_us[k].push_back(1e6 * (line_delay_s - scene.lens.line_delay_s));
    };
    add(0, calibration.lens[kLineDelay]);
    add(1, line_delay_by(data, calibration, scene.noise_px, Standardisation::kNone));
    add(2, line_delay_by(data, calibration, scene.noise_px, Standardisation::kDerived));
    add(3, line_delay_by(data, calibration, scene.noise_px, Standardisation::kAsPrinted));
  }
  table.title =
      "Standardisation (Oth 15 to 21): line delay of 82.5 us, 12 frames/s, 30 s, a hand 1.5 times "
      "as fast, lens known, " +
      std::to_string(errors_us[0].size()) + " recordings";
  table.header = {"residual by", "rms error, us", "mean error, us"};
  for (std::size_t k = 0; k < kNames.size(); ++k)
    table.rows.push_back(
        {kNames[k], number(root_mean_square(errors_us[k]), 4), number(mean(errors_us[k]), 3)});
  table.print(out);
}

}  // namespace alidade::test

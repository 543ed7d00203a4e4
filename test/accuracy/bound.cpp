#include "test/accuracy/bound.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace alidade::test {
namespace {

constexpr double kKnotSpacing = 0.25;  // s

// Of all unknowns but the landmarks; then come the control points, pan and tilt alternating.
enum Unknown {
  kImageOffset = kParameterCount,
  kImagePeriod,
  kTelemetryOffset,
  kTelemetryPeriod,
  kFirstControlPoint
};

// The four weights of a uniform cubic B-spline and where they begin.
struct Weights {
  int first = 0;
  std::array<double, 4> weight{};
};

Weights spline_weights(double begin, double time) {
  Weights w;
  const double position = std::max(0.0, (time - begin) / kKnotSpacing);
  w.first = static_cast<int>(position);
  const double x = position - w.first;
  w.weight = {std::pow(1 - x, 3) / 6, (3 * x * x * x - 6 * x * x + 4) / 6,
              (-3 * x * x * x + 3 * x * x + 3 * x + 1) / 6, x * x * x / 6};
  return w;
}

Eigen::Matrix<double, 3, 2> any_basis(const Eigen::Vector3d& d) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = d.unitOrthogonal();
  basis.col(1) = d.cross(basis.col(0));
  return basis;
}

Eigen::Vector2d rate(const Simulation& s, double time) {
  constexpr double kStep = 1e-4;
  return (s.angles(time + kStep) - s.angles(time - kStep)) / (2 * kStep);
}

// One scalar measurement's derivatives: few of the many unknowns.
struct Row {
  std::vector<int> index;
  std::vector<double> value;
  void clear() {
    index.clear();
    value.clear();
  }
  void add(int i, double x) {
    index.push_back(i);
    value.push_back(x);
  }
};

class Information {
 public:
  explicit Information(int unknowns) : matrix_(Eigen::MatrixXd::Zero(unknowns, unknowns)) {}

  void add(const Row& row, double sigma) {
    for (std::size_t a = 0; a < row.index.size(); ++a) {
      for (std::size_t b = 0; b < row.index.size(); ++b) {
        matrix_(row.index[a], row.index[b]) += row.value[a] * row.value[b] / (sigma * sigma);
      }
    }
  }
  void add_known(int i, double sigma) { matrix_(i, i) += 1 / (sigma * sigma); }
  [[nodiscard]] Eigen::MatrixXd& matrix() { return matrix_; }

 private:
  Eigen::MatrixXd matrix_;
};

// Pixels of the simulator's projection for small changes of what it depends on.
class Differences {
 public:
  Differences(const Simulation& s, const Bound& bound) : s_(s), bound_(bound) {}

  // d pixel / d parameter of lens or mount.
  [[nodiscard]] Eigen::Vector2d by_parameter(Parameter parameter, const Eigen::Vector2d& angle,
                                             const Eigen::Vector3d& d) const {
    constexpr double kStep = 1e-5;
    const double step = parameter == Parameter::kFocalLength ? kStep * s_.focal_length : kStep;
    std::array<Eigen::Vector2d, 2> pixel;
    for (const int sign : {0, 1}) {
      const double change = sign == 0 ? -step : step;
      Simulation changed = s_;
      switch (parameter) {
        case Parameter::kFocalLength:
          changed.focal_length += change;
          break;
        case Parameter::kAspect:
          changed.aspect += change;
          break;
        case Parameter::kRadialDistortion:
          changed.radial_distortion += change;
          break;
        case Parameter::kCentreU:
        case Parameter::kCentreV:
          changed.optical_centre_offset_px[parameter == Parameter::kCentreV] += change;
          break;
        case Parameter::kPanAxis0:
        case Parameter::kPanAxis1:
          changed.pan_axis += change * bound_.pan_basis.col(parameter == Parameter::kPanAxis1);
          changed.pan_axis.normalize();
          break;
        default:
          changed.tilt_axis += change * bound_.tilt_basis.col(parameter == Parameter::kTiltAxis1);
          changed.tilt_axis.normalize();
      }
      pixel[static_cast<std::size_t>(sign)] = at(changed, angle, d);
    }
    return (pixel[1] - pixel[0]) / (2 * step);
  }

  [[nodiscard]] Eigen::Matrix2d by_angle(const Eigen::Vector2d& angle,
                                         const Eigen::Vector3d& d) const {
    const double step = 0.01 / s_.focal_length;
    Eigen::Matrix2d J;
    for (const int i : {0, 1}) {
      const Eigen::Vector2d change = step * Eigen::Vector2d::Unit(i);
      J.col(i) = (at(s_, angle + change, d) - at(s_, angle - change, d)) / (2 * step);
    }
    return J;
  }

  [[nodiscard]] Eigen::Matrix2d by_landmark(const Eigen::Vector2d& angle,
                                            const Eigen::Vector3d& d) const {
    const double step = 0.01 / s_.focal_length;
    const Eigen::Matrix<double, 3, 2> basis = any_basis(d);
    Eigen::Matrix2d J;
    for (const int i : {0, 1}) {
      const Eigen::Vector3d change = step * basis.col(i);
      J.col(i) = (at(s_, angle, d + change) - at(s_, angle, d - change)) / (2 * step);
    }
    return J;
  }

 private:
  static Eigen::Vector2d at(const Simulation& s, const Eigen::Vector2d& angle,
                            const Eigen::Vector3d& d) {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    static_cast<void>(internal::pixel_at(s, angle, d, &pixel[0], &pixel[1]));
    return pixel;
  }

  const Simulation& s_;
  const Bound& bound_;
};

}  // namespace

Bound compute_bound(const Simulation& s, const SimulatedRecording& recording,
                    const CalibrationOptions& options) {
  Bound bound;
  bound.pan_basis = any_basis(s.pan_axis);
  bound.tilt_basis = any_basis(s.tilt_axis);
  const CalibrationInput& input = recording.input;

  // Which parameters are unknown, and their priors.
  std::array<bool, kParameterCount> given{};
  for (int i = 0; i < kParameterCount; ++i) {
    const std::optional<double> sigma = options.prior_sigma(static_cast<Parameter>(i));
    given[static_cast<std::size_t>(i)] = sigma == 0.0;
    bound.prior_sigma[i] = sigma.value_or(0);
  }

  double begin = recording.telemetry_time_s.front();
  double end = recording.telemetry_time_s.back();
  for (const double time : recording.frame_time_s) {
    const double last_row = time + s.line_delay * s.height;
    begin = std::min({begin, time, last_row});
    end = std::max({end, time, last_row});
  }
  const int control_points = static_cast<int>((end - begin) / kKnotSpacing) + 4;
  const int unknowns = kFirstControlPoint + 2 * control_points;
  Information information(unknowns);
  const auto tick = [](double time, double first, double rate_hz) {
    return std::round((time - first) * rate_hz);
  };

  // Stamps, periods, telemetry. Ticks are counted from the middle, where offset and period part.
  Row row;
  const double image_middle = recording.frame_time_s[recording.frame_time_s.size() / 2];
  const double telemetry_middle = recording.telemetry_time_s[recording.telemetry_time_s.size() / 2];
  for (const double time : recording.frame_time_s) {
    row.clear();
    row.add(kImageOffset, 1);
    row.add(kImagePeriod, tick(time, image_middle, s.image_rate_hz));
    information.add(row, s.image_stamp_sigma_s);
  }
  for (std::size_t m = 0; m < recording.telemetry_time_s.size(); ++m) {
    const double time = recording.telemetry_time_s[m];
    const double n = tick(time, telemetry_middle, s.telemetry_rate_hz);
    row.clear();
    row.add(kTelemetryOffset, 1);
    row.add(kTelemetryPeriod, n);
    information.add(row, s.telemetry_stamp_sigma_s);
    if (recording.telemetry_is_outlier[m]) continue;
    const Weights w = spline_weights(begin, time);
    const Eigen::Vector2d angle = s.angles(time);
    const Eigen::Vector2d angle_rate = rate(s, time);
    // Rounding to a quantum adds its uniform noise.
    const double sigma = std::hypot(s.pan_tilt_sigma, s.angle_quantum_rad / std::sqrt(12.0));
    for (const int i : {0, 1}) {
      const double scale = i == 0 ? s.pan_scale : s.tilt_scale;
      row.clear();
      row.add(index(Parameter::kPanScale) + i, angle[i]);
      row.add(index(Parameter::kClockOffset), -scale * angle_rate[i]);
      row.add(kTelemetryOffset, scale * angle_rate[i]);
      row.add(kTelemetryPeriod, scale * angle_rate[i] * n);
      for (int c = 0; c < 4; ++c) {
        row.add(kFirstControlPoint + 2 * (w.first + c) + i,
                scale * w.weight[static_cast<std::size_t>(c)]);
      }
      information.add(row, sigma);
    }
  }
  information.add_known(kImagePeriod, s.image_period_sigma_s);
  information.add_known(kTelemetryPeriod, s.telemetry_period_sigma_s);

  // Pixels; each landmark is eliminated through H - W V^-1 W^T.
  std::vector<std::vector<std::size_t>> observations_of(recording.landmarks.size());
  for (std::size_t i = 0; i < input.observations.size(); ++i) {
    if (recording.observation_is_outlier[i]) continue;
    observations_of[static_cast<std::size_t>(input.observations[i].landmark)].push_back(i);
  }
  std::vector<double> time_of_frame(static_cast<std::size_t>(input.frames.back().frame) + 1);
  for (std::size_t n = 0; n < input.frames.size(); ++n) {
    time_of_frame[static_cast<std::size_t>(input.frames[n].frame)] = recording.frame_time_s[n];
  }
  const Differences differences(s, bound);
  std::array<Row, 2> rows;
  Eigen::MatrixXd W(unknowns, 2);
  for (std::size_t l = 0; l < recording.landmarks.size(); ++l) {
    if (observations_of[l].size() < 2) continue;  // seen once, a landmark says nothing
    const Eigen::Vector3d& d = recording.landmarks[l];
    W.setZero();
    Eigen::Matrix2d V = Eigen::Matrix2d::Zero();
    for (const std::size_t o : observations_of[l]) {
      const CalibrationObservation& observation = input.observations[o];
      const double frame_time = time_of_frame[static_cast<std::size_t>(observation.frame)];
      const double time = frame_time + observation.v_px * s.line_delay;
      const Eigen::Vector2d angle = s.angles(time);
      const Eigen::Matrix2d J_angle = differences.by_angle(angle, d);
      const Eigen::Vector2d per_second = J_angle * rate(s, time);
      Eigen::Matrix2d solve_row = Eigen::Matrix2d::Identity();
      solve_row.col(1) -= per_second * s.line_delay;
      const Eigen::Matrix2d total = solve_row.inverse();

      for (Row& r : rows) r.clear();
      const auto add = [&](int unknown, const Eigen::Vector2d& J) {
        const Eigen::Vector2d J_total = total * J;
        for (const int i : {0, 1}) rows[static_cast<std::size_t>(i)].add(unknown, J_total[i]);
      };
      for (const Parameter p :
           {Parameter::kFocalLength, Parameter::kAspect, Parameter::kRadialDistortion,
            Parameter::kCentreU, Parameter::kCentreV, Parameter::kPanAxis0, Parameter::kPanAxis1,
            Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
        if (!given[static_cast<std::size_t>(index(p))]) {
          add(index(p), differences.by_parameter(p, angle, d));
        }
      }
      add(index(Parameter::kLineDelay), per_second * observation.v_px);
      add(kImageOffset, per_second);
      add(kImagePeriod, per_second * tick(frame_time, image_middle, s.image_rate_hz));
      const Weights w = spline_weights(begin, time);
      for (int c = 0; c < 4; ++c) {
        for (const int i : {0, 1}) {
          add(kFirstControlPoint + 2 * (w.first + c) + i,
              J_angle.col(i) * w.weight[static_cast<std::size_t>(c)]);
        }
      }
      const Eigen::Matrix2d J_landmark = total * differences.by_landmark(angle, d);
      const double weight = 1 / (observation.sigma_px * observation.sigma_px);
      V += weight * J_landmark.transpose() * J_landmark;
      for (const int i : {0, 1}) {
        const Row& r = rows[static_cast<std::size_t>(i)];
        information.add(r, observation.sigma_px);
        for (std::size_t a = 0; a < r.index.size(); ++a) {
          W.row(r.index[a]) += weight * r.value[a] * J_landmark.row(i);
        }
      }
    }
    information.matrix().noalias() -= W * V.inverse() * W.transpose();
  }

  Eigen::MatrixXd& H = information.matrix();
  for (int i = 0; i < kParameterCount; ++i) {
    if (bound.prior_sigma[i] > 0) information.add_known(i, bound.prior_sigma[i]);
    if (given[static_cast<std::size_t>(i)]) {
      H.row(i).setZero();
      H.col(i).setZero();
      H(i, i) = 1;
    }
  }
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * H * scale.asDiagonal());
  bound.ok = factor.info() == Eigen::Success && factor.isPositive();
  if (!bound.ok) return bound;
  const Eigen::MatrixXd columns =
      factor.solve(Eigen::MatrixXd::Identity(unknowns, kParameterCount));
  const auto parameters = scale.head<kParameterCount>().asDiagonal();
  bound.covariance = parameters * columns.topRows<kParameterCount>() * parameters;
  for (int i = 0; i < kParameterCount; ++i) {
    if (!given[static_cast<std::size_t>(i)]) continue;
    bound.covariance.row(i).setZero();
    bound.covariance.col(i).setZero();
  }
  bound.ok = bound.covariance.allFinite();
  return bound;
}

ParameterVector expected_nees(const Bound& bound, const ParameterVector& spread) {
  ParameterVector expected = ParameterVector::Ones();
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j) {
      const double s2 = bound.prior_sigma[j] * bound.prior_sigma[j];
      const double c = bound.covariance(i, j);
      if (s2 == 0 || bound.covariance(i, i) == 0) continue;
      expected[i] += c * c * (spread[j] * spread[j] - s2) / (s2 * s2) / bound.covariance(i, i);
    }
  }
  return expected;
}

}  // namespace alidade::test

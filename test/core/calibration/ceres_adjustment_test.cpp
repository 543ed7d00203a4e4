// The adjustment beside Ceres: its derivatives beside ceres::Jet on residuals written here from the definition, its
// minimum and its covariance beside those of another solver.

#include "test/core/calibration/ceres_adjustment.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/calibration/adjustment.h"
#include "test/core/calibration/adjustment_problem.h"

namespace alidade::test {
namespace {

namespace internal = ::alidade::internal;
using internal::Adjustment;
using internal::AdjustmentObservation;
using internal::AdjustmentPriors;
using internal::AdjustmentState;
using internal::AdjustmentTelemetry;
using internal::GlobalMatrix;
using internal::kDrift;
using internal::kGlobalCount;
using internal::Linearisation;
using internal::LossScales;

// ---- the residuals from their definition, on any scalar ----

// The local parameters that one residual meets, as changes of the state.
template <class S>
struct Changes {
  std::array<Vector2<S>, 4> control_points;
  Eigen::Matrix<S, kGlobalCount, 1> globals;
  Vector2<S> landmark;

  Changes() : globals(Eigen::Matrix<S, kGlobalCount, 1>::Zero()), landmark(S(0), S(0)) {
    control_points.fill(Vector2<S>(S(0), S(0)));
  }
};
constexpr int kLandmarkVariable = 8 + kGlobalCount;
constexpr int kVariables = kLandmarkVariable + 2;
using Variable = ceres::Jet<double, kVariables>;

Changes<Variable> variables() {
  Changes<Variable> changes;
  for (int i = 0; i < 8; ++i) {
    changes.control_points[static_cast<std::size_t>(i / 2)][i % 2] = Variable(0, i);
  }
  for (int i = 0; i < kGlobalCount; ++i) changes.globals[i] = Variable(0, 8 + i);
  for (int i = 0; i < 2; ++i) changes.landmark[i] = Variable(0, kLandmarkVariable + i);
  return changes;
}

template <class S>
class Model {
 public:
  Model(const AdjustmentState& state, int segment, const Changes<S>& changes)
      : state_(state), segment_(segment), changes_(changes) {
    const auto change = [&](Parameter p) { return changes.globals[index(p)]; };
    const auto axis = [&](const Vector3<double>& a, Parameter first) {
      return direction_plus<S>(Vector3<S>(a.cast<S>()),
                               Vector2<S>(changes.globals.template segment<2>(index(first))));
    };
    using std::exp;
    using std::pow;
    const double R = 0.5 * std::hypot(state.camera.width, state.camera.height);
    const S f = state.camera.focal_length * exp(change(Parameter::kFocalLength));
    camera_ = {
        f,
        state.camera.aspect * exp(change(Parameter::kAspect)),
        {(state.corner_distortion[0] + change(Parameter::kRadialDistortion)) * f * f / (R * R)},
        state.camera.width,
        state.camera.height,
        state.camera.centre_u + change(Parameter::kCentreU),
        state.camera.centre_v + change(Parameter::kCentreV)};
    line_delay_ = (state.readout_s + change(Parameter::kLineDelay)) / S(state.camera.height);
    mechanics_ = {axis(state.mechanics.pan_axis, Parameter::kPanAxis0),
                  axis(state.mechanics.tilt_axis, Parameter::kTiltAxis0),
                  state.mechanics.pan_scale + change(Parameter::kPanScale),
                  state.mechanics.tilt_scale + change(Parameter::kTiltScale)};
  }

  [[nodiscard]] const S& line_delay() const { return line_delay_; }

  // De Boor's algorithm.
  template <class T>
  [[nodiscard]] Vector2<T> angle(const T& time) const {
    std::array<Vector2<T>, 4> d;
    for (int j = 0; j < 4; ++j) {
      const auto n = static_cast<std::size_t>(j);
      d[n] = (state_.trajectory.control_point(segment_ + j).cast<S>() + changes_.control_points[n])
                 .template cast<T>();
    }
    for (int r = 1; r <= 3; ++r) {
      for (int j = 3; j >= r; --j) {
        const double left = state_.trajectory.knot(segment_ + j - 3);
        const double right = state_.trajectory.knot(segment_ + j + 1 - r);
        const T share = (time - T(left)) / T(right - left);
        const auto n = static_cast<std::size_t>(j);
        d[n] = (T(1) - share) * d[n - 1] + share * d[n];
      }
    }
    return d[3];
  }

  // Where landmark d_anchor would be seen at one time.
  template <class T>
  [[nodiscard]] Vector2<T> pixel(const T& time, const Vector3<double>& d_anchor) const {
    const Vector2<T> p = angle<T>(time);
    const Vector3<S> d_a = direction_plus<S>(Vector3<S>(d_anchor.cast<S>()), changes_.landmark);
    const PanTilt<S> anchor = state_.anchor.cast<S>();
    const Vector3<S> d_b = R_base_from_camera(mechanics_, anchor) * d_a;
    const Matrix3<T> R = R_base_from_camera(mechanics_.template cast<T>(), PanTilt<T>{p[0], p[1]});
    Vector2<T> u(T(0), T(0));
    if (project(camera_.template cast<T>(), R.transpose() * d_b.template cast<T>(), &u) !=
        ProjectionStatus::kOk) {
      ADD_FAILURE() << "no projection";
    }
    return u;
  }

  // Where the rolling shutter sees it: the row at which row and time agree.
  [[nodiscard]] Vector2<S> rolling_pixel(double frame_time, const Vector3<double>& d_anchor) const {
    Vector2<S> u(S(0), S(0.5 * state_.camera.height));
    for (int i = 0; i < 60; ++i) {
      u = pixel<S>(S(frame_time) + u.y() * line_delay_, d_anchor);
    }
    return u;
  }

  [[nodiscard]] Vector2<S> telemetry(const AdjustmentTelemetry& sample, double reference) const {
    const double since = sample.time_s - reference;
    const S time = S(sample.time_s) -
                   (state_.shift_s + changes_.globals[index(Parameter::kClockOffset)]) +
                   (state_.drift + changes_.globals[kDrift]) * since;
    const Vector2<S> p = angle<S>(time);
    const Vector2<S> error(sample.measured[0] - mechanics_.pan_scale * p[0],
                           sample.measured[1] - mechanics_.tilt_scale * p[1]);
    return {wrap_angle(error[0]) / sample.sigma[0], wrap_angle(error[1]) / sample.sigma[1]};
  }

  [[nodiscard]] Eigen::Matrix<S, kGlobalCount, 1> prior(const AdjustmentState& mean) const {
    using std::log;
    const double R = 0.5 * std::hypot(mean.camera.width, mean.camera.height);
    const double f = mean.camera.focal_length;
    Eigen::Matrix<S, kGlobalCount, 1> e;
    e << log(f / camera_.focal_length), log(mean.camera.aspect / camera_.aspect),
        mean.corner_distortion[0] - camera_.distortion.radial * (R * R / (f * f)),
        mean.camera.centre_u - camera_.centre_u, mean.camera.centre_v - camera_.centre_v,
        mean.readout_s - line_delay_ * S(state_.camera.height),
        -direction_minus<S>(mechanics_.pan_axis, mean.mechanics.pan_axis.cast<S>()),
        -direction_minus<S>(mechanics_.tilt_axis, mean.mechanics.tilt_axis.cast<S>()),
        mean.mechanics.pan_scale - mechanics_.pan_scale,
        mean.mechanics.tilt_scale - mechanics_.tilt_scale,
        mean.shift_s - state_.shift_s - changes_.globals[index(Parameter::kClockOffset)],
        mean.drift - state_.drift - changes_.globals[kDrift];
    return e;
  }

 private:
  const AdjustmentState& state_;
  int segment_;
  Changes<S> changes_;
  Camera<S> camera_;
  S line_delay_;
  Mechanics<S> mechanics_;
};

// kObserved: A^-1 (u - pi) with A held while it is differentiated; kProjected: u less the full projection.
Vector2<Variable> observation_residual(const AdjustmentState& state, double frame_time,
                                       const AdjustmentObservation& o, ObservationRow row) {
  const double time = frame_time + o.u.y() * state.line_delay();
  const int segment = state.trajectory.segment_at(time);
  const Model<Variable> model(state, segment, variables());
  const Vector3<double>& d = state.landmarks[static_cast<std::size_t>(o.landmark)];
  const Vector2<Variable> observed = o.u.cast<Variable>();
  if (row == ObservationRow::kProjected) {
    return (observed - model.rolling_pixel(frame_time, d)) / Variable(o.sigma);
  }
  using Time = ceres::Jet<double, 1>;
  const Vector2<Time> u = Model<double>(state, segment, {}).pixel<Time>(Time(time, 0), d);
  Matrix2<double> A = Matrix2<double>::Identity();
  A(0, 1) = -u[0].v[0] * state.line_delay();
  A(1, 1) -= u[1].v[0] * state.line_delay();
  const Vector2<Variable> raw =
      observed - model.pixel<Variable>(Variable(frame_time) + o.u.y() * model.line_delay(), d);
  return Matrix2<double>(A.inverse() / o.sigma).cast<Variable>() * raw;
}

// ---- scenes at ugly values ----

struct Ugly {
  std::string name;
  double focal_length;
  double aspect;
  double distortion;  // at the corner: k (R / f)^2
  double readout_s;
  double pan;
  double tilt;
};

std::vector<Ugly> ugly_scenes() {
  return {{"plain", 3000, 1, 0.02, 0.02, 0, 0},
          {"barrel, camera upside down", 3000, 1.01, -0.05, -0.02, 0.6, -0.3},
          {"no line delay, no distortion", 3000, 1, 0, 0, 0.6, 0.2},
          {"narrow, at the seam", 1e5, 0.98, 0.03, 0.015, kPi - 1e-3, 0.9},
          {"wide barrel, at the other seam", 700, 1, -0.1, -0.03, -kPi + 1e-3, 0.4},
          {"wide pincushion, far round", 700, 1.02, 0.3, 0.03, -2.5, -0.8}};
}

AdjustmentProblem make_ugly_problem(const Ugly& ugly) {
  AdjustmentProblem problem;
  AdjustmentState& s = problem.start;
  s.camera = {ugly.focal_length, ugly.aspect, {0}, 1920, 1080, 14, -9};
  s.corner_distortion[0] = ugly.distortion;
  s.readout_s = ugly.readout_s;
  s.mechanics.pan_axis = Vector3<double>(0.03, -0.01, 1).normalized();
  s.mechanics.tilt_axis = Vector3<double>(-0.02, 1, 0.04).normalized();
  s.mechanics.pan_scale = 1.01;
  s.mechanics.tilt_scale = 0.98;
  s.shift_s = 0.03;
  s.drift = 1e-4;
  s.trajectory = TrajectorySpline({0, 0.5, 0.7, 1.2, 2});
  const double half_field = std::atan(960 / ugly.focal_length);
  for (int i = 0; i < s.trajectory.control_points(); ++i) {
    s.trajectory.control_point(i) = {ugly.pan + 0.5 * half_field * std::sin(1.1 * i),
                                     ugly.tilt + 0.3 * half_field * std::cos(1.3 * i)};
  }
  s.anchor = {ugly.pan, ugly.tilt};
  auto& data = problem.data;
  for (int f = 0; f < 8; ++f) data.frame_time_s.push_back(0.15 + 0.23 * f);

  // Each frame has landmarks at the corners and on a grid, seen again wherever another frame shows them.
  const Matrix3<double> R_base_from_anchor = R_base_from_camera(s.mechanics, s.anchor);
  for (std::size_t f = 0; f < data.frame_time_s.size(); f += 3) {
    for (int i = 0; i < 16; ++i) {
      const Vector2<double> u(1920.0 * (i % 4) / 3, 1080.0 * (i / 4) / 3);
      Vector3<double> d_c = Vector3<double>::UnitZ();
      if (unproject(s.physical_camera(), u, &d_c) != ProjectionStatus::kOk) {
        ADD_FAILURE() << ugly.name;
      }
      const double time = data.frame_time_s[f] + u.y() * s.line_delay();
      const Matrix3<double> R = R_base_from_camera(s.mechanics, s.trajectory.position(time));
      s.landmarks.push_back((R_base_from_anchor.transpose() * R * d_c).normalized());
    }
  }
  for (std::size_t l = 0; l < s.landmarks.size(); ++l) {
    for (std::size_t f = 0; f < data.frame_time_s.size(); ++f) {
      const double middle = data.frame_time_s[f] + 0.5 * s.readout_s;
      const Model<double> model(s, s.trajectory.segment_at(middle), {});
      const PanTilt<double> p = s.trajectory.position(middle);
      const Vector3<double> d_b = R_base_from_anchor * s.landmarks[l];
      if (R_base_from_camera(s.mechanics, p).col(2).dot(d_b) < std::cos(1.25 * half_field))
        continue;
      const Vector2<double> u = model.rolling_pixel(data.frame_time_s[f], s.landmarks[l]);
      if (u.x() < -1 || u.x() > 1921 || u.y() < -1 || u.y() > 1081) continue;
      const double n = static_cast<double>(data.observations.size());
      data.observations.push_back({static_cast<int>(l), static_cast<int>(f),
                                   u + Vector2<double>(std::sin(7 * n), std::cos(3 * n)), 0.3,
                                   true});
    }
  }
  data.reference_s = 1;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.04 + 0.032 * i;
    const double time = t - s.shift_s + s.drift * (t - data.reference_s);
    const PanTilt<double> p = s.trajectory.position(time);
    const double noise = 1e-4 * std::sin(5.0 * i);
    data.telemetry.push_back({t,
                              {wrap_angle(s.mechanics.pan_scale * p.pan + noise),
                               wrap_angle(s.mechanics.tilt_scale * p.tilt - noise)},
                              {1e-4, 2e-4},
                              {true, true}});
  }
  // Priors that pull.
  AdjustmentState& mean = problem.priors.mean;
  mean = s;
  mean.camera.focal_length *= 1.05;
  mean.camera.aspect *= 0.97;
  mean.corner_distortion[0] += 0.05;
  mean.camera.set_centre_offset({-3, 20});
  mean.readout_s += 0.01;
  mean.mechanics.pan_axis = direction_plus(s.mechanics.pan_axis, Vector2<double>(0.05, -0.1));
  mean.mechanics.tilt_axis = direction_plus(s.mechanics.tilt_axis, Vector2<double>(-0.07, 0.03));
  mean.mechanics.pan_scale = mean.mechanics.tilt_scale = 1;
  mean.shift_s = 0.1;
  mean.drift = 0;
  problem.priors.information.setLinSpaced(1e4, 1e6);
  return problem;
}

// Residuals and Jacobian of a problem from Jets, laid out like CeresAdjustment::linearise, least squares.
void jet_jacobian(const AdjustmentProblem& problem, ObservationRow row, Eigen::VectorXd* e,
                  Eigen::MatrixXd* J) {
  const AdjustmentState& s = problem.start;
  const auto& data = problem.data;
  const int global = 2 * s.trajectory.control_points();
  const Eigen::Index landmark = global + kGlobalCount;
  const auto rows = static_cast<Eigen::Index>(2 * data.observations.size() +
                                              2 * data.telemetry.size() + kGlobalCount);
  e->resize(rows);
  J->setZero(rows, landmark + 2 * static_cast<Eigen::Index>(s.landmarks.size()));
  Eigen::Index at = 0;
  const auto put = [&](const Variable& value, int segment, int landmark_index) {
    (*e)[at] = value.a;
    J->row(at).segment<8>(2 * segment) += value.v.head<8>();
    J->row(at).segment<kGlobalCount>(global) = value.v.segment<kGlobalCount>(8);
    if (landmark_index >= 0) {
      J->row(at).segment<2>(landmark + 2 * landmark_index) = value.v.tail<2>();
    }
    ++at;
  };
  for (const auto& o : data.observations) {
    const double frame_time = data.frame_time_s[static_cast<std::size_t>(o.frame)];
    const int segment = s.trajectory.segment_at(frame_time + o.u.y() * s.line_delay());
    const Vector2<Variable> residual = observation_residual(s, frame_time, o, row);
    for (int i = 0; i < 2; ++i) put(residual[i], segment, o.landmark);
  }
  for (const auto& sample : data.telemetry) {
    const double time = sample.time_s - s.shift_s + s.drift * (sample.time_s - data.reference_s);
    const int segment = s.trajectory.segment_at(time);
    const Vector2<Variable> residual =
        Model<Variable>(s, segment, variables()).telemetry(sample, data.reference_s);
    for (int i = 0; i < 2; ++i) put(residual[i], segment, -1);
  }
  const auto prior = Model<Variable>(s, 0, variables()).prior(problem.priors.mean);
  for (int i = 0; i < kGlobalCount; ++i) {
    put(prior[i] * std::sqrt(problem.priors.information[i]), 0, -1);
  }
}

// The whole normal matrix and right-hand side of a Linearisation: control points, globals, landmarks.
void full_system(const Linearisation& at, Eigen::MatrixXd* H, Eigen::VectorXd* g) {
  const Eigen::Index size = at.g.size();
  const Eigen::Index total = size + 2 * static_cast<Eigen::Index>(at.g_landmark.size());
  H->setZero(total, total);
  g->resize(total);
  Eigen::MatrixXd without_landmarks;
  at.H.copy_to(&without_landmarks);
  H->topLeftCorner(size, size) = without_landmarks;
  g->head(size) = at.g;
  for (std::size_t l = 0; l < at.H_landmark.size(); ++l) {
    const Eigen::Index row = size + 2 * static_cast<Eigen::Index>(l);
    H->block<2, 2>(row, row) = at.H_landmark[l];
    g->segment<2>(row) = at.g_landmark[l];
    for (std::size_t i = at.touched_begin[l]; i < at.touched_begin[l + 1]; ++i) {
      H->block<2, 2>(row, 2 * at.touched[i]) = at.H_touched[i].transpose();
    }
    H->block<2, internal::kObservedCount>(row, size - kGlobalCount) = at.H_camera[l].transpose();
  }
  *H = H->selfadjointView<Eigen::Lower>();
}

// Largest |a - b| with every column in units of b's largest element there.
double column_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  double worst = 0;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    const double scale = b.col(j).cwiseAbs().maxCoeff();
    if (scale == 0 && a.col(j).isZero(0)) continue;
    worst = std::max(worst, (a.col(j) - b.col(j)).cwiseAbs().maxCoeff() / scale);
  }
  return worst;
}

TEST(CeresAdjustment, JacobiansOfTheCostFunctionsAreThoseOfJets) {
  for (const Ugly& ugly : ugly_scenes()) {
    SCOPED_TRACE(ugly.name);
    const AdjustmentProblem problem = make_ugly_problem(ugly);
    ASSERT_GT(problem.data.observations.size(), 100u);
    for (const ObservationRow row : {ObservationRow::kObserved, ObservationRow::kProjected}) {
      SCOPED_TRACE(row == ObservationRow::kObserved ? "observed row" : "projected row");
      Eigen::VectorXd e_jet;
      Eigen::MatrixXd J_jet;
      jet_jacobian(problem, row, &e_jet, &J_jet);
      CeresAdjustment ceres(problem.data, problem.priors, problem.fixed, {}, row, problem.start);
      Eigen::VectorXd e;
      Eigen::MatrixXd J;
      ceres.linearise(&e, &J);
      ASSERT_EQ(J.rows(), J_jet.rows());
      EXPECT_LE((e - e_jet).cwiseAbs().maxCoeff(), 1e-7);
      EXPECT_LE(column_difference(J, J_jet), 1e-8);
    }
  }
}

TEST(CeresAdjustment, NormalEquationsAreThoseOfJets) {
  for (const Ugly& ugly : ugly_scenes()) {
    SCOPED_TRACE(ugly.name);
    AdjustmentProblem problem = make_ugly_problem(ugly);
    Eigen::VectorXd e;
    Eigen::MatrixXd J;
    jet_jacobian(problem, ObservationRow::kObserved, &e, &J);
    for (const double scale : {std::numeric_limits<double>::infinity(), 3.0, 0.5}) {
      // Cauchy: a pair of rows weighs 1 / (1 + |e|^2 / c^2).
      Eigen::VectorXd weight = Eigen::VectorXd::Ones(e.size());
      double cost = e.tail<kGlobalCount>().squaredNorm();
      for (Eigen::Index i = 0; i + kGlobalCount < e.size(); i += 2) {
        const double ratio = e.segment<2>(i).squaredNorm() / (scale * scale);
        weight.segment<2>(i).setConstant(1 / (1 + ratio));
        cost +=
            std::isinf(scale) ? e.segment<2>(i).squaredNorm() : scale * scale * std::log1p(ratio);
      }
      const Eigen::MatrixXd H_jet = J.transpose() * weight.asDiagonal() * J;
      const Eigen::VectorXd g_jet = -J.transpose() * weight.cwiseProduct(e);
      Adjustment adjustment(problem.data, problem.priors, problem.fixed);
      Linearisation at;
      adjustment.linearise(problem.start, {scale, scale}, &at);
      Eigen::MatrixXd H;
      Eigen::VectorXd g;
      full_system(at, &H, &g);
      const Eigen::VectorXd unit = H_jet.diagonal().cwiseSqrt().cwiseInverse();
      EXPECT_LE((unit.asDiagonal() * (H - H_jet) * unit.asDiagonal()).cwiseAbs().maxCoeff(), 1e-9)
          << scale;
      EXPECT_LE(unit.cwiseProduct(g - g_jet).cwiseAbs().maxCoeff(), 1e-9 * e.norm()) << scale;
      EXPECT_NEAR(at.cost, cost, 1e-10 * cost) << scale;
    }
  }
}

// ---- the minimum ----

struct Recording {
  std::string name;
  Simulation simulation;
  LossScales loss;
  double knot_spacing_s = 0.5;
};

std::vector<Recording> recordings() {
  std::vector<Recording> all;
  const auto add = [&all](const std::string& name) -> Recording& {
    Recording recording;
    recording.name = name;
    recording.simulation.seed = 100 + all.size();
    recording.simulation.duration_s = 6;
    recording.simulation.image_rate_hz = 10;
    recording.simulation.landmarks_per_field = 6;
    all.push_back(recording);
    return all.back();
  };
  add("plain");
  Recording& outliers = add("outliers, Cauchy");
  outliers.simulation.image_outliers = 0.1;
  outliers.simulation.telemetry_outliers = 0.1;
  outliers.loss = {3, 3};
  Recording& rolling = add("strong rolling shutter, many knots");
  rolling.simulation.line_delay = 3e-5;
  rolling.simulation.image_rate_hz = 15;
  rolling.knot_spacing_s = 0.25;
  Recording& turned = add("camera upside down, barrel");
  turned.simulation.line_delay = -2e-5;
  turned.simulation.radial_distortion = -0.3;
  Recording& far = add("across the seam");
  far.simulation.pan_offset_rad = 2.9;
  Recording& narrow = add("narrow field");
  narrow.simulation.focal_length = 1e5;
  narrow.simulation.radial_distortion = 200;
  narrow.simulation.pan_tilt_sigma = 1e-5;
  Recording& wide = add("wide field");
  wide.simulation.focal_length = 1000;
  wide.simulation.radial_distortion = -0.05;
  wide.simulation.duration_s = 4;
  return all;
}

// Globals of b relative to a, local.
internal::GlobalVector difference(const AdjustmentState& a, const AdjustmentState& b) {
  internal::GlobalVector d;
  d << std::log(b.camera.focal_length / a.camera.focal_length),
      std::log(b.camera.aspect / a.camera.aspect), b.corner_distortion[0] - a.corner_distortion[0],
      b.camera.centre_u - a.camera.centre_u, b.camera.centre_v - a.camera.centre_v,
      b.readout_s - a.readout_s,
      direction_minus<double>(b.mechanics.pan_axis, a.mechanics.pan_axis),
      direction_minus<double>(b.mechanics.tilt_axis, a.mechanics.tilt_axis),
      b.mechanics.pan_scale - a.mechanics.pan_scale,
      b.mechanics.tilt_scale - a.mechanics.tilt_scale, b.shift_s - a.shift_s, b.drift - a.drift;
  return d;
}

struct OwnMinimum {
  bool converged = false;
  AdjustmentState state;
  double cost = 0;
  GlobalMatrix covariance;
};

OwnMinimum minimise(const AdjustmentProblem& problem, const LossScales& loss) {
  OwnMinimum minimum;
  minimum.state = problem.start;
  Adjustment adjustment(problem.data, problem.priors, problem.fixed);
  Linearisation at;
  double telemetry_unknowns = 0;
  // A robust loss is reweighted: it converges by a constant factor a step.
  minimum.converged = adjustment.minimise(loss, 400, 1e-8, &minimum.state, &at) &&
                      adjustment.covariance(at, &minimum.covariance, &telemetry_unknowns);
  minimum.cost = at.cost;
  return minimum;
}

TEST(CeresAdjustment, ReachesTheSameMinimumWithTheSameCovariance) {
  for (const Recording& recording : recordings()) {
    SCOPED_TRACE(recording.name);
    const AdjustmentProblem problem =
        make_adjustment_problem(recording.simulation, recording.knot_spacing_s);
    ASSERT_GT(problem.data.observations.size(), 1000u);
    const OwnMinimum own = minimise(problem, recording.loss);
    ASSERT_TRUE(own.converged);
    const CeresMinimum ceres = minimise_by_ceres(
        problem.data, problem.priors, problem.fixed, recording.loss, ObservationRow::kObserved,
        CeresAdjustment::options(ceres::DENSE_SCHUR, 1e-13), problem.start);
    ASSERT_TRUE(ceres.converged);
    ASSERT_TRUE(ceres.adjustment->at_home());

    Linearisation there;
    Adjustment(problem.data, problem.priors, problem.fixed)
        .linearise(ceres.adjustment->state(), recording.loss, &there);
    EXPECT_NEAR(there.cost, own.cost, 1e-9 * own.cost);
    const auto moved = difference(own.state, ceres.adjustment->state());
    // At one and the same state: in a narrow field a thousandth of a sigma changes the axes' by more than 1e-6.
    CeresAdjustment here(problem.data, problem.priors, problem.fixed, recording.loss,
                         ObservationRow::kObserved, own.state);
    GlobalMatrix covariance;
    ASSERT_TRUE(here.covariance(&covariance));
    for (int i = 0; i < kGlobalCount; ++i) {
      EXPECT_LE(std::abs(moved[i]), 1e-3 * std::sqrt(own.covariance(i, i))) << i;
      for (int j = 0; j < kGlobalCount; ++j) {
        EXPECT_NEAR(covariance(i, j), own.covariance(i, j),
                    1e-6 * std::sqrt(own.covariance(i, i) * own.covariance(j, j)))
            << i << ", " << j;
      }
    }
  }
}

// A derivative at the observed row sees that row's noise again. Half a tenth of a sigma, added squarely, is a
// thousandth of the error.
TEST(CeresAdjustment, HoldingTheRowTimeEffectHardlyMovesTheMinimum) {
  for (const Recording& recording : recordings()) {
    SCOPED_TRACE(recording.name);
    const AdjustmentProblem problem =
        make_adjustment_problem(recording.simulation, recording.knot_spacing_s);
    const OwnMinimum own = minimise(problem, recording.loss);
    ASSERT_TRUE(own.converged);
    const CeresMinimum exact = minimise_by_ceres(
        problem.data, problem.priors, problem.fixed, recording.loss, ObservationRow::kProjected,
        CeresAdjustment::options(ceres::DENSE_SCHUR, 1e-13), problem.start);
    ASSERT_TRUE(exact.converged);
    const auto moved = difference(own.state, exact.adjustment->state());
    for (int i = 0; i < kGlobalCount; ++i) {
      EXPECT_LE(std::abs(moved[i]), 0.05 * std::sqrt(own.covariance(i, i))) << i;
    }
  }
}

}  // namespace
}  // namespace alidade::test

#include "test/core/calibration/ceres_adjustment.h"

#include <Eigen/LU>
#include <cmath>

namespace alidade::test {

namespace {

using ::alidade::internal::AdjustmentData;
using ::alidade::internal::AdjustmentObservation;
using ::alidade::internal::AdjustmentPriors;
using ::alidade::internal::AdjustmentState;
using ::alidade::internal::AdjustmentTelemetry;
using ::alidade::internal::GlobalMatrix;
using ::alidade::internal::GlobalVector;
using ::alidade::internal::kDrift;
using ::alidade::internal::kGlobalCount;
using ::alidade::internal::LossScales;

template <int kRows, int kColumns>
using RowMajor = Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>>;
template <int kColumns, class Expression>
void write(const Expression& value, double* J) {
  RowMajor<2, kColumns> block(J);
  block = value;
}
using Map2 = Eigen::Map<const Vector2<double>>;
using Map3 = Eigen::Map<const Vector3<double>>;

// As in adjustment.cpp.
constexpr double kMaxRowSlope = 0.9;
constexpr double kLostError = 1e5;

class DirectionManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return 3; }
  [[nodiscard]] int TangentSize() const override { return 2; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    Eigen::Map<Vector3<double>> result(x_plus_delta);
    result =
        direction_plus<double>(Vector3<double>(Map3(x)), Vector2<double>(Map2(delta))).normalized();
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    RowMajor<3, 2> J(jacobian);
    J = tangent_basis<double>(Map3(x));
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector2<double>> result(y_minus_x);
    result = direction_minus<double>(Map3(y), Map3(x));
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    RowMajor<2, 3> J(jacobian);
    J = tangent_basis<double>(Map3(x)).transpose();
    return true;
  }
};

// The parameter blocks that are no control points and no landmarks.
struct Blocks {
  Vector2<double> lens;    // log f, distortion
  Vector2<double> centre;  // px, from the image's middle
  double log_aspect = 0;
  Vector2<double> timing;  // read-out time, shift
  double drift = 0;
  Vector3<double> pan_axis;
  Vector3<double> tilt_axis;
  double pan_scale = 1;
  double tilt_scale = 1;
};

// What all residuals of one point share.
class Shared final : public ceres::EvaluationCallback {
 public:
  Shared(const AdjustmentState& state, const Blocks& blocks) : state_(state), blocks_(blocks) {}

  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (!new_evaluation_point && ready_) return;
    ready_ = true;
    camera = state_.camera;
    camera.focal_length = std::exp(blocks_.lens[0]);
    camera.aspect = std::exp(blocks_.log_aspect);
    camera.set_centre_offset(blocks_.centre);
    distortion_unit = corner_unit(camera)[0];
    camera.distortion.radial = blocks_.lens[1] * distortion_unit;
    line_delay = blocks_.timing[0] / camera.height;
    mechanics.pan_axis = blocks_.pan_axis;
    mechanics.tilt_axis = blocks_.tilt_axis;
    B_pan_axis = tangent_basis(mechanics.pan_axis);
    B_tilt_axis = tangent_basis(mechanics.tilt_axis);
    R_base_from_anchor = R_base_from_camera(mechanics, state_.anchor, nullptr, &J_xi_axes_anchor);
  }

  Camera<double> camera;
  double distortion_unit = 1;
  double line_delay = 0;
  Mechanics<double> mechanics;
  Matrix<double, 3, 2> B_pan_axis;
  Matrix<double, 3, 2> B_tilt_axis;
  Matrix3<double> R_base_from_anchor;
  Matrix<double, 3, 4> J_xi_axes_anchor;

 private:
  const AdjustmentState& state_;
  const Blocks& blocks_;
  bool ready_ = false;
};

// One segment of the spline, good for any time: its weights in powers of x.
struct Segment {
  double begin_s = 0;
  double length_s = 1;
  Matrix4<double> from_power;

  Segment(const TrajectorySpline& spline, int segment)
      : begin_s(spline.knot(segment)), length_s(spline.knot(segment + 1) - begin_s) {
    Matrix4<double> weights;
    Matrix4<double> powers;
    for (int i = 0; i < 4; ++i) {
      const double x = 0.1 + 0.25 * i;
      weights.col(i) = spline.basis(begin_s + x * length_s, segment).weight;
      powers.col(i) << 1, x, x * x, x * x * x;
    }
    from_power = weights * powers.inverse();
  }

  void weights(double time_s, Vector4<double>* weight, Vector4<double>* rate_weight) const {
    const double x = (time_s - begin_s) / length_s;
    *weight = from_power * Vector4<double>(1, x, x * x, x * x * x);
    *rate_weight = from_power.rightCols<3>() * (Vector3<double>(1, 2 * x, 3 * x * x) / length_s);
  }
};

// Pan and tilt, and their rates, from four control points.
struct Motion {
  Vector4<double> weight;
  Vector2<double> angle;
  Vector2<double> rate;

  Motion(const Segment& segment, double time_s, double const* const* points) {
    Vector4<double> rate_weight;
    segment.weights(time_s, &weight, &rate_weight);
    angle.setZero();
    rate.setZero();
    for (int i = 0; i < 4; ++i) {
      angle += weight[i] * Map2(points[i]);
      rate += rate_weight[i] * Map2(points[i]);
    }
  }
};

// Parameters: four control points, lens, timing, pan axis, tilt axis, aspect, landmark, centre.
class ObservationCost final : public ceres::SizedCostFunction<2, 2, 2, 2, 2, 2, 2, 3, 3, 1, 3, 2> {
 public:
  ObservationCost(const AdjustmentObservation& observation, double frame_time_s,
                  const Segment& segment, const Shared& shared, ObservationRow row,
                  bool may_be_lost)
      : observation_(observation),
        frame_time_s_(frame_time_s),
        segment_(segment),
        shared_(shared),
        row_(row),
        may_be_lost_(may_be_lost) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Map3 d_anchor(parameters[9]);
    const Vector3<double> d_b = shared_.R_base_from_anchor * d_anchor;
    double row = observation_.u.y();
    if (row_ == ObservationRow::kProjected) {
      Vector2<double> u;
      Vector2<double> slope;
      if (!project_at(row, d_b, parameters, &u, &slope, nullptr)) return lost(residuals, jacobians);
      row += (u.y() - row) / (1 - slope.y());
    }
    Vector2<double> u;
    Vector2<double> slope;
    Jacobians J;
    if (!project_at(row, d_b, parameters, &u, &slope, jacobians == nullptr ? nullptr : &J)) {
      return lost(residuals, jacobians);
    }
    // The row at which the landmark is seen, by Newton from `row`; the projection there.
    const double rows = (u.y() - row) / (1 - slope.y());
    Eigen::Map<Vector2<double>> error(residuals);
    error = (observation_.u - Vector2<double>(u.x() + slope.x() * rows, row + rows)) /
            observation_.sigma;
    if (jacobians == nullptr) return true;

    Matrix2<double> whiten;
    whiten << 1, slope.x() / (1 - slope.y()), 0, 1 / (1 - slope.y());
    whiten /= -observation_.sigma;
    const Matrix2<double> J_angle = whiten * J.J_u_angle;
    for (int i = 0; i < 4; ++i) {
      if (jacobians[i] != nullptr) write<2>(J.weight[i] * J_angle, jacobians[i]);
    }
    const Matrix<double, 2, 3> J_u_anchor =
        (J.J_u_dc * J.R_base_from_camera.transpose()) * shared_.R_base_from_anchor;
    const Camera<double>& camera = shared_.camera;
    if (jacobians[4] != nullptr) {
      RowMajor<2, 2> J_lens(jacobians[4]);
      J_lens.col(0) = whiten * (camera.focal_length * J.J_u_camera.col(0) +
                                2 * camera.distortion.radial * J.J_u_camera.col(2));
      J_lens.col(1) = whiten * (shared_.distortion_unit * J.J_u_camera.col(2));
    }
    if (jacobians[5] != nullptr) {
      RowMajor<2, 2> J_timing(jacobians[5]);
      J_timing.col(0) = whiten * (J.J_u_time * (row / camera.height));
      J_timing.col(1).setZero();
    }
    if (jacobians[6] != nullptr || jacobians[7] != nullptr) {
      const Matrix<double, 2, 4> J_axes =
          whiten * (J.J_u_xi * J.J_xi_axes -
                    (J_u_anchor * skew<double>(d_anchor)) * shared_.J_xi_axes_anchor);
      if (jacobians[6] != nullptr) {
        write<3>(J_axes.leftCols<2>() * shared_.B_pan_axis.transpose(), jacobians[6]);
      }
      if (jacobians[7] != nullptr) {
        write<3>(J_axes.rightCols<2>() * shared_.B_tilt_axis.transpose(), jacobians[7]);
      }
    }
    if (jacobians[8] != nullptr) {
      Eigen::Map<Vector2<double>> J_aspect(jacobians[8]);
      J_aspect = whiten * (camera.aspect * J.J_u_camera.col(1));
    }
    if (jacobians[9] != nullptr) {
      write<3>(whiten * J_u_anchor, jacobians[9]);
    }
    if (jacobians[10] != nullptr) {
      write<2>(whiten * J.J_u_camera.rightCols<2>(), jacobians[10]);
    }
    return true;
  }

 private:
  struct Jacobians {
    Vector4<double> weight;
    Matrix3<double> R_base_from_camera;
    Matrix<double, 3, 4> J_xi_axes;
    Matrix<double, 2, 3> J_u_dc;
    Matrix<double, 2, 3> J_u_xi;
    Matrix<double, 2, kCameraParameterCount> J_u_camera;
    Matrix2<double> J_u_angle;
    Vector2<double> J_u_time;
  };

  // The landmark's pixel at the time of a row, and its change with the row.
  bool project_at(double row, const Vector3<double>& d_b, double const* const* parameters,
                  Vector2<double>* u, Vector2<double>* slope, Jacobians* J) const {
    const Motion motion(segment_, frame_time_s_ + row * shared_.line_delay, parameters);
    Matrix<double, 3, 2> J_xi_angle;
    const Matrix3<double> R =
        R_base_from_camera(shared_.mechanics, {motion.angle[0], motion.angle[1]}, &J_xi_angle,
                           J == nullptr ? nullptr : &J->J_xi_axes);
    const Vector3<double> d_c = R.transpose() * d_b;
    Matrix<double, 2, 3> J_u_dc;
    if (project(shared_.camera, d_c, u, &J_u_dc, J == nullptr ? nullptr : &J->J_u_camera) !=
        ProjectionStatus::kOk) {
      return false;
    }
    const Matrix<double, 2, 3> J_u_xi = J_u_dc * skew(d_c);
    const Matrix2<double> J_u_angle = J_u_xi * J_xi_angle;
    const Vector2<double> J_u_time = J_u_angle * motion.rate;
    *slope = J_u_time * shared_.line_delay;
    if (slope->y() > kMaxRowSlope) return false;
    if (J != nullptr) {
      J->weight = motion.weight;
      J->R_base_from_camera = R;
      J->J_u_dc = J_u_dc;
      J->J_u_xi = J_u_xi;
      J->J_u_angle = J_u_angle;
      J->J_u_time = J_u_time;
    }
    return true;
  }

  bool lost(double* residuals, double** jacobians) const {
    if (!may_be_lost_) return false;
    residuals[0] = kLostError;
    residuals[1] = 0;
    if (jacobians == nullptr) return true;
    for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i) {
      if (jacobians[i] != nullptr) std::fill_n(jacobians[i], 2 * parameter_block_sizes()[i], 0.0);
    }
    return true;
  }

  const AdjustmentObservation& observation_;
  const double frame_time_s_;
  const Segment& segment_;
  const Shared& shared_;
  const ObservationRow row_;
  const bool may_be_lost_;
};

// Parameters: four control points, pan scale, tilt scale, timing, drift.
class TelemetryCost final : public ceres::SizedCostFunction<2, 2, 2, 2, 2, 1, 1, 2, 1> {
 public:
  TelemetryCost(const AdjustmentTelemetry& sample, double reference_s, const Segment& segment)
      : sample_(sample), since_reference_s_(sample.time_s - reference_s), segment_(segment) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Motion motion(segment_,
                        sample_.time_s - parameters[6][1] + parameters[7][0] * since_reference_s_,
                        parameters);
    const Vector2<double> scale(parameters[4][0], parameters[5][0]);
    for (int i = 0; i < 2; ++i) {
      residuals[i] =
          wrap_angle(sample_.measured[i] - scale[i] * motion.angle[i]) / sample_.sigma[i];
    }
    if (jacobians == nullptr) return true;
    const Vector2<double> slope = -scale.cwiseQuotient(sample_.sigma);
    for (int i = 0; i < 4; ++i) {
      if (jacobians[i] != nullptr) {
        write<2>(Matrix2<double>((motion.weight[i] * slope).asDiagonal()), jacobians[i]);
      }
    }
    const Vector2<double> by_scale = -motion.angle.cwiseQuotient(sample_.sigma);
    if (jacobians[4] != nullptr) {
      jacobians[4][0] = by_scale[0];
      jacobians[4][1] = 0;
    }
    if (jacobians[5] != nullptr) {
      jacobians[5][0] = 0;
      jacobians[5][1] = by_scale[1];
    }
    const Vector2<double> by_time = slope.cwiseProduct(motion.rate);
    if (jacobians[6] != nullptr) {
      RowMajor<2, 2> J_timing(jacobians[6]);
      J_timing.col(0).setZero();
      J_timing.col(1) = -by_time;
    }
    if (jacobians[7] != nullptr) {
      jacobians[7][0] = by_time[0] * since_reference_s_;
      jacobians[7][1] = by_time[1] * since_reference_s_;
    }
    return true;
  }

 private:
  const AdjustmentTelemetry& sample_;
  const double since_reference_s_;
  const Segment& segment_;
};

// Parameters: lens, timing, pan axis, tilt axis, aspect, pan scale, tilt scale, drift, centre.
class PriorCost final : public ceres::SizedCostFunction<kGlobalCount, 2, 2, 3, 3, 1, 1, 1, 1, 2> {
 public:
  explicit PriorCost(const AdjustmentPriors& priors)
      : mean_(priors.mean), root_(priors.information.cwiseSqrt()) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    constexpr int kAxes[] = {index(Parameter::kPanAxis0), index(Parameter::kTiltAxis0)};
    Eigen::Map<GlobalVector> e(residuals);
    const double stretch = std::exp(2 * (parameters[0][0] - std::log(mean_.camera.focal_length)));
    e[index(Parameter::kFocalLength)] = std::log(mean_.camera.focal_length) - parameters[0][0];
    e[index(Parameter::kRadialDistortion)] =
        mean_.corner_distortion[0] - parameters[0][1] * stretch;
    e.segment<2>(index(Parameter::kCentreU)) = mean_.camera.centre_offset() - Map2(parameters[8]);
    e[index(Parameter::kLineDelay)] = mean_.readout_s - parameters[1][0];
    e[index(Parameter::kClockOffset)] = mean_.shift_s - parameters[1][1];
    Matrix<double, 2, 3> J_axis[2];
    e.segment<2>(kAxes[0]) =
        -direction_minus<double>(Map3(parameters[2]), mean_.mechanics.pan_axis, &J_axis[0]);
    e.segment<2>(kAxes[1]) =
        -direction_minus<double>(Map3(parameters[3]), mean_.mechanics.tilt_axis, &J_axis[1]);
    e[index(Parameter::kAspect)] = std::log(mean_.camera.aspect) - parameters[4][0];
    e[index(Parameter::kPanScale)] = mean_.mechanics.pan_scale - parameters[5][0];
    e[index(Parameter::kTiltScale)] = mean_.mechanics.tilt_scale - parameters[6][0];
    e[kDrift] = mean_.drift - parameters[7][0];
    e = e.cwiseProduct(root_).eval();
    if (jacobians == nullptr) return true;

    const auto set = [&](int block, int row, int column, double value) {
      const int columns = parameter_block_sizes()[static_cast<std::size_t>(block)];
      jacobians[block][row * columns + column] = root_[row] * value;
    };
    for (int block = 0; block < 9; ++block) {
      if (jacobians[block] == nullptr) continue;
      const int columns = parameter_block_sizes()[static_cast<std::size_t>(block)];
      std::fill_n(jacobians[block], kGlobalCount * columns, 0.0);
      switch (block) {
        case 0:
          set(block, index(Parameter::kFocalLength), 0, -1);
          set(block, index(Parameter::kRadialDistortion), 0, -2 * parameters[0][1] * stretch);
          set(block, index(Parameter::kRadialDistortion), 1, -stretch);
          break;
        case 1:
          set(block, index(Parameter::kLineDelay), 0, -1);
          set(block, index(Parameter::kClockOffset), 1, -1);
          break;
        case 2:
        case 3:
          for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 3; ++j)
              set(block, kAxes[block - 2] + i, j, -J_axis[block - 2](i, j));
          }
          break;
        case 4:
          set(block, index(Parameter::kAspect), 0, -1);
          break;
        case 5:
          set(block, index(Parameter::kPanScale), 0, -1);
          break;
        case 6:
          set(block, index(Parameter::kTiltScale), 0, -1);
          break;
        case 7:
          set(block, kDrift, 0, -1);
          break;
        default:
          set(block, index(Parameter::kCentreU), 0, -1);
          set(block, index(Parameter::kCentreV), 1, -1);
      }
    }
    return true;
  }

 private:
  const AdjustmentState& mean_;
  const GlobalVector root_;
};

}  // namespace

struct CeresAdjustment::Implementation {
  Implementation(const AdjustmentData& data_in, const AdjustmentPriors& priors_in,
                 const std::array<bool, kGlobalCount>& fixed_in, const LossScales& loss,
                 ObservationRow row, const AdjustmentState& start)
      : data(data_in), priors(priors_in), fixed(fixed_in), state(start), shared(state, blocks) {
    blocks.lens << std::log(state.camera.focal_length), state.corner_distortion[0];
    blocks.centre = state.camera.centre_offset();
    blocks.log_aspect = std::log(state.camera.aspect);
    blocks.timing << state.readout_s, state.shift_s;
    blocks.drift = state.drift;
    blocks.pan_axis = state.mechanics.pan_axis;
    blocks.tilt_axis = state.mechanics.tilt_axis;
    blocks.pan_scale = state.mechanics.pan_scale;
    blocks.tilt_scale = state.mechanics.tilt_scale;

    ceres::Problem::Options options;
    options.disable_all_safety_checks = true;
    options.evaluation_callback = &shared;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem = std::make_unique<ceres::Problem>(options);
    for (int i = 0; i < state.trajectory.segments(); ++i)
      segments.emplace_back(state.trajectory, i);
    if (std::isfinite(loss.pixel)) pixel_loss = std::make_unique<ceres::CauchyLoss>(loss.pixel);
    if (std::isfinite(loss.telemetry)) {
      telemetry_loss = std::make_unique<ceres::CauchyLoss>(loss.telemetry);
    }
    add_observations(row);
    add_telemetry();
    problem->AddResidualBlock(new PriorCost(priors), nullptr, blocks.lens.data(),
                              blocks.timing.data(), blocks.pan_axis.data(), blocks.tilt_axis.data(),
                              &blocks.log_aspect, &blocks.pan_scale, &blocks.tilt_scale,
                              &blocks.drift, blocks.centre.data());
    set_manifolds();
  }

  [[nodiscard]] double* point(int i) { return state.trajectory.control_point(i).data(); }
  [[nodiscard]] const Segment& segment(int i) const {
    return segments[static_cast<std::size_t>(i)];
  }

  void add_observations(ObservationRow row) {
    int hint = 0;
    for (const AdjustmentObservation& o : data.observations) {
      if (!o.used) continue;
      const double frame_time = data.frame_time_s[static_cast<std::size_t>(o.frame)];
      hint = state.trajectory.segment_at(frame_time + o.u.y() * state.line_delay(), hint);
      home.push_back(hint);
      problem->AddResidualBlock(
          new ObservationCost(o, frame_time, segment(hint), shared, row, pixel_loss != nullptr),
          pixel_loss.get(), point(hint), point(hint + 1), point(hint + 2), point(hint + 3),
          blocks.lens.data(), blocks.timing.data(), blocks.pan_axis.data(), blocks.tilt_axis.data(),
          &blocks.log_aspect, state.landmarks[static_cast<std::size_t>(o.landmark)].data(),
          blocks.centre.data());
    }
  }

  void add_telemetry() {
    int hint = 0;
    for (const AdjustmentTelemetry& sample : data.telemetry) {
      if (!sample.used) continue;
      hint = state.trajectory.segment_at(telemetry_time(sample), hint);
      home.push_back(hint);
      problem->AddResidualBlock(new TelemetryCost(sample, data.reference_s, segment(hint)),
                                telemetry_loss.get(), point(hint), point(hint + 1), point(hint + 2),
                                point(hint + 3), &blocks.pan_scale, &blocks.tilt_scale,
                                blocks.timing.data(), &blocks.drift);
    }
  }

  [[nodiscard]] double telemetry_time(const AdjustmentTelemetry& sample) const {
    return sample.time_s - state.shift_s + state.drift * (sample.time_s - data.reference_s);
  }

  void set_manifolds() {
    const auto is_fixed = [this](Parameter p) { return fixed[static_cast<std::size_t>(index(p))]; };
    for (auto& landmark : state.landmarks) {
      if (problem->HasParameterBlock(landmark.data())) {
        problem->SetManifold(landmark.data(), &direction);
      }
    }
    const auto set_axis = [&](double* block, Parameter first) {
      problem->SetManifold(block, &direction);
      if (is_fixed(first)) problem->SetParameterBlockConstant(block);
    };
    set_axis(blocks.pan_axis.data(), Parameter::kPanAxis0);
    set_axis(blocks.tilt_axis.data(), Parameter::kTiltAxis0);
    const auto set_pair = [&](double* block, Parameter first, Parameter second) {
      if (is_fixed(first) && is_fixed(second)) {
        problem->SetParameterBlockConstant(block);
      } else if (is_fixed(first) || is_fixed(second)) {
        halves.push_back(
            std::make_unique<ceres::SubsetManifold>(2, std::vector<int>{is_fixed(first) ? 0 : 1}));
        problem->SetManifold(block, halves.back().get());
      }
    };
    set_pair(blocks.lens.data(), Parameter::kFocalLength, Parameter::kRadialDistortion);
    set_pair(blocks.centre.data(), Parameter::kCentreU, Parameter::kCentreV);
    set_pair(blocks.timing.data(), Parameter::kLineDelay, Parameter::kClockOffset);
    const auto set_single = [&](double* block, int i) {
      if (fixed[static_cast<std::size_t>(i)]) problem->SetParameterBlockConstant(block);
    };
    set_single(&blocks.log_aspect, index(Parameter::kAspect));
    set_single(&blocks.pan_scale, index(Parameter::kPanScale));
    set_single(&blocks.tilt_scale, index(Parameter::kTiltScale));
    set_single(&blocks.drift, kDrift);
  }

  void read_blocks() {
    state.camera.focal_length = std::exp(blocks.lens[0]);
    state.corner_distortion[0] = blocks.lens[1];
    state.camera.aspect = std::exp(blocks.log_aspect);
    state.camera.set_centre_offset(blocks.centre);
    state.readout_s = blocks.timing[0];
    state.shift_s = blocks.timing[1];
    state.drift = blocks.drift;
    state.mechanics = {blocks.pan_axis, blocks.tilt_axis, blocks.pan_scale, blocks.tilt_scale};
  }

  // The globals' blocks and, for each of their local parameters, its number in Adjustment. Fixed ones have none.
  struct GlobalBlock {
    double* values;
    std::vector<int> columns;
  };
  [[nodiscard]] std::vector<GlobalBlock> global_blocks() {
    std::vector<GlobalBlock> all = {
        {blocks.lens.data(), {index(Parameter::kFocalLength), index(Parameter::kRadialDistortion)}},
        {&blocks.log_aspect, {index(Parameter::kAspect)}},
        {blocks.centre.data(), {index(Parameter::kCentreU), index(Parameter::kCentreV)}},
        {blocks.timing.data(), {index(Parameter::kLineDelay), index(Parameter::kClockOffset)}},
        {blocks.pan_axis.data(), {index(Parameter::kPanAxis0), index(Parameter::kPanAxis1)}},
        {blocks.tilt_axis.data(), {index(Parameter::kTiltAxis0), index(Parameter::kTiltAxis1)}},
        {&blocks.pan_scale, {index(Parameter::kPanScale)}},
        {&blocks.tilt_scale, {index(Parameter::kTiltScale)}},
        {&blocks.drift, {kDrift}}};
    std::vector<GlobalBlock> free;
    for (const GlobalBlock& block : all) {
      GlobalBlock kept{block.values, {}};
      for (const int column : block.columns) {
        if (!fixed[static_cast<std::size_t>(column)]) kept.columns.push_back(column);
      }
      if (!kept.columns.empty()) free.push_back(kept);
    }
    return free;
  }

  const AdjustmentData& data;
  const AdjustmentPriors& priors;
  const std::array<bool, kGlobalCount> fixed;
  AdjustmentState state;
  Blocks blocks;
  Shared shared;
  DirectionManifold direction;
  std::vector<std::unique_ptr<ceres::SubsetManifold>> halves;
  std::vector<Segment> segments;
  std::vector<int> home;  // the segment of each residual: observations, then telemetry
  std::unique_ptr<ceres::LossFunction> pixel_loss;
  std::unique_ptr<ceres::LossFunction> telemetry_loss;
  std::unique_ptr<ceres::Problem> problem;
};

CeresAdjustment::CeresAdjustment(const AdjustmentData& data, const AdjustmentPriors& priors,
                                 const std::array<bool, kGlobalCount>& fixed,
                                 const LossScales& loss, ObservationRow row,
                                 const AdjustmentState& start)
    : implementation_(std::make_unique<Implementation>(data, priors, fixed, loss, row, start)) {}

CeresAdjustment::~CeresAdjustment() = default;

ceres::Solver::Options CeresAdjustment::options(ceres::LinearSolverType solver,
                                                double relative_tolerance) {
  ceres::Solver::Options options;
  options.linear_solver_type = solver;
  options.num_threads = 1;
  options.max_num_iterations = 400;
  options.initial_trust_region_radius = 1e8;
  options.function_tolerance = relative_tolerance;
  options.parameter_tolerance = 1e-16;
  options.gradient_tolerance = 1e-16;
  options.logging_type = ceres::SILENT;
  return options;
}

ceres::Solver::Summary CeresAdjustment::solve(ceres::Solver::Options options) {
  Implementation& in = *implementation_;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& landmark : in.state.landmarks) {
    if (in.problem->HasParameterBlock(landmark.data())) {
      ordering->AddElementToGroup(landmark.data(), 0);
    }
  }
  for (int i = 0; i < in.state.trajectory.control_points(); ++i) {
    if (in.problem->HasParameterBlock(in.point(i))) ordering->AddElementToGroup(in.point(i), 1);
  }
  for (double* block : {in.blocks.lens.data(), in.blocks.centre.data(), &in.blocks.log_aspect,
                        in.blocks.timing.data(), &in.blocks.drift, in.blocks.pan_axis.data(),
                        in.blocks.tilt_axis.data(), &in.blocks.pan_scale, &in.blocks.tilt_scale}) {
    ordering->AddElementToGroup(block, 1);
  }
  options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, in.problem.get(), &summary);
  in.read_blocks();
  return summary;
}

bool CeresAdjustment::at_home() const {
  const Implementation& in = *implementation_;
  std::size_t next = 0;
  for (const AdjustmentObservation& o : in.data.observations) {
    if (!o.used) continue;
    const double time =
        in.data.frame_time_s[static_cast<std::size_t>(o.frame)] + o.u.y() * in.state.line_delay();
    if (in.state.trajectory.segment_at(time, in.home[next]) != in.home[next]) return false;
    ++next;
  }
  for (const AdjustmentTelemetry& sample : in.data.telemetry) {
    if (!sample.used) continue;
    if (in.state.trajectory.segment_at(in.telemetry_time(sample), in.home[next]) != in.home[next]) {
      return false;
    }
    ++next;
  }
  return true;
}

const AdjustmentState& CeresAdjustment::state() const { return implementation_->state; }

void CeresAdjustment::linearise(Eigen::VectorXd* residuals, Eigen::MatrixXd* J) {
  Implementation& in = *implementation_;
  ceres::Problem::EvaluateOptions options;
  std::vector<int> columns;  // of *J
  const auto add = [&](double* block, const std::vector<int>& to) {
    options.parameter_blocks.push_back(block);
    columns.insert(columns.end(), to.begin(), to.end());
  };
  const int global = 2 * in.state.trajectory.control_points();
  for (int i = 0; i < in.state.trajectory.control_points(); ++i) {
    if (in.problem->HasParameterBlock(in.point(i))) add(in.point(i), {2 * i, 2 * i + 1});
  }
  for (const auto& block : in.global_blocks()) {
    std::vector<int> to;
    for (const int column : block.columns) to.push_back(global + column);
    add(block.values, to);
  }
  const int landmark = global + kGlobalCount;
  for (std::size_t i = 0; i < in.state.landmarks.size(); ++i) {
    double* block = in.state.landmarks[i].data();
    const int first = landmark + 2 * static_cast<int>(i);
    if (in.problem->HasParameterBlock(block)) add(block, {first, first + 1});
  }
  std::vector<double> errors;
  ceres::CRSMatrix sparse;
  double cost = 0;
  in.problem->Evaluate(options, &cost, &errors, nullptr, &sparse);
  *residuals = Eigen::Map<Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
  J->setZero(sparse.num_rows, landmark + 2 * static_cast<Eigen::Index>(in.state.landmarks.size()));
  for (int row = 0; row < sparse.num_rows; ++row) {
    const auto r = static_cast<std::size_t>(row);
    for (auto i = static_cast<std::size_t>(sparse.rows[r]);
         i < static_cast<std::size_t>(sparse.rows[r + 1]); ++i) {
      (*J)(row, columns[static_cast<std::size_t>(sparse.cols[i])]) = sparse.values[i];
    }
  }
}

bool CeresAdjustment::covariance(GlobalMatrix* result) {
  Implementation& in = *implementation_;
  const auto free = in.global_blocks();
  std::vector<const double*> values;
  std::vector<int> columns;
  for (const auto& block : free) {
    values.push_back(block.values);
    columns.insert(columns.end(), block.columns.begin(), block.columns.end());
  }
  ceres::Covariance::Options options;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  if (!covariance.Compute(values, in.problem.get())) return false;
  const auto size = static_cast<Eigen::Index>(columns.size());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> dense(size, size);
  if (!covariance.GetCovarianceMatrixInTangentSpace(values, dense.data())) return false;
  result->setZero();
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      (*result)(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]) =
          dense(i, j);
    }
  }
  return true;
}

CeresMinimum minimise_by_ceres(const AdjustmentData& data, const AdjustmentPriors& priors,
                               const std::array<bool, kGlobalCount>& fixed, const LossScales& loss,
                               ObservationRow row, const ceres::Solver::Options& options,
                               const AdjustmentState& start) {
  constexpr int kMaxProblems = 20;
  CeresMinimum result;
  AdjustmentState state = start;
  while (result.problems < kMaxProblems) {
    result.adjustment = std::make_unique<CeresAdjustment>(data, priors, fixed, loss, row, state);
    ++result.problems;
    const ceres::Solver::Summary summary = result.adjustment->solve(options);
    result.iterations += static_cast<int>(summary.iterations.size()) - 1;
    result.converged = summary.termination_type == ceres::CONVERGENCE;
    if (!result.converged || result.adjustment->at_home()) break;
    state = result.adjustment->state();
  }
  return result;
}

}  // namespace alidade::test

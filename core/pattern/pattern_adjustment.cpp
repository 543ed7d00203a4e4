#include "core/pattern/pattern_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>

#include "core/pattern/image_cells.h"
#include "core/pattern/moving_projection.h"

namespace alidade::internal {
namespace {

constexpr int kLensBlock = 4;  // index of the lens's parameter block, after four control points

ControlPoints points_of(double const* const* parameters) {
  ControlPoints points;
  for (int i = 0; i < 4; ++i) points.col(i) = Eigen::Map<const PoseVector>(parameters[i]);
  return points;
}

// Residuals of one frame's observations whose rows were exposed in one segment. Few large blocks
// are several times faster than one for each point. Each observation is made robust by itself: r
// w(s), s = |r|^2, with (r w)^2 = Cauchy's c^2 log(1 + s / c^2).
class FrameCost : public ceres::CostFunction {
 public:
  FrameCost(const PatternData* data, const PoseCurve* curve, int frame, int segment,
            std::vector<int> observations, const PatternAdjustmentOptions& options)
      : data_(data),
        curve_(curve),
        frame_(frame),
        segment_(segment),
        observations_(std::move(observations)),
        sigma_px_(options.sigma_px),
        robust_scale_(options.robust_scale) {
    for (int i = 0; i < 4; ++i) mutable_parameter_block_sizes()->push_back(6);
    mutable_parameter_block_sizes()->push_back(kLensParameterCount);
    set_num_residuals(2 * static_cast<int>(observations_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const ControlPoints points = points_of(parameters);
    const LensVector lens = Eigen::Map<const LensVector>(parameters[kLensBlock]);
    const PatternFrame& frame = data_->frames[static_cast<std::size_t>(frame_)];
    MovingProjection projection;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const PatternObservation& observation =
          frame.observations[static_cast<std::size_t>(observations_[i])];
      const Vector3<double>& p = data_->points_m[static_cast<std::size_t>(observation.point)];
      if (project_moving(*curve_, segment_, points, lens, frame.time_s, p, observation.u.y(),
                         &projection, jacobians != nullptr) != ProjectionStatus::kOk) {
        return false;
      }
      const Vector2<double> r = (projection.u - observation.u) / sigma_px_;
      const auto [w, dw_ds] = robust_weight(r.squaredNorm());
      Eigen::Map<Vector2<double>> out(residuals + 2 * i);
      out = w * r;
      if (jacobians == nullptr) continue;
      const Matrix2<double> scale =
          (w * Matrix2<double>::Identity() + 2 * dw_ds * r * r.transpose()) / sigma_px_;
      const auto row = static_cast<Eigen::Index>(2 * i);
      const Matrix<double, 2, 6> J_x = scale * projection.J_u_x;
      for (int k = 0; k < 4; ++k) {
        if (jacobians[k] == nullptr) continue;
        Block<6>(jacobians[k], num_residuals(), 6).middleRows<2>(row) =
            projection.basis.weight[k] * J_x;
      }
      if (jacobians[kLensBlock] != nullptr) {
        Block<kLensParameterCount>(jacobians[kLensBlock], num_residuals(), kLensParameterCount)
            .middleRows<2>(row) = scale * projection.J_u_lens;
      }
    }
    return true;
  }

 private:
  template <int kColumns>
  using Block = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor>>;

  [[nodiscard]] std::pair<double, double> robust_weight(double s) const {
    if (robust_scale_ <= 0) return {1, 0};
    const double c2 = robust_scale_ * robust_scale_;
    const double x = s / c2;
    if (x < 1e-4) return {1 - x / 4, -1 / (4 * c2)};
    const double w = std::sqrt(std::log1p(x) / x);
    return {w, (1 / (1 + x) - w * w) / (2 * x * w * c2)};
  }

  const PatternData* data_;
  const PoseCurve* curve_;
  int frame_;
  int segment_;
  std::vector<int> observations_;
  double sigma_px_;
  double robust_scale_;
};

// Gauss quadrature over a segment with two points: exact for the square of an acceleration, which
// is linear there.
struct Moment {
  double time_s, weight_s;
};
std::array<Moment, 2> moments_of(const PoseCurve& curve, int segment) {
  const double begin = curve.knot(segment);
  const double length = curve.knot(segment + 1) - begin;
  const double off = 0.5 / std::sqrt(3.0);
  return {{{begin + length * (0.5 - off), length / 2}, {begin + length * (0.5 + off), length / 2}}};
}

// Integral of the squared accelerations over a segment.
class AccelerationCost : public ceres::SizedCostFunction<12, 6, 6, 6, 6> {
 public:
  AccelerationCost(const PoseCurve& curve, int segment, const PatternAdjustmentOptions& options) {
    PoseVector scale;
    scale << Vector3<double>::Constant(1 / std::sqrt(options.position_noise)),
        Vector3<double>::Constant(1 / std::sqrt(options.rotation_noise));
    const std::array<Moment, 2> moments = moments_of(curve, segment);
    for (std::size_t g = 0; g < moments.size(); ++g) {
      const Vector4<double> weights = curve.acceleration_weights(segment, moments[g].time_s);
      for (int k = 0; k < 4; ++k) {
        factor_[g][static_cast<std::size_t>(k)] =
            weights[k] * std::sqrt(moments[g].weight_s) * scale;
      }
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int g = 0; g < 2; ++g) {
      Eigen::Map<PoseVector> out(residuals + 6 * g);
      out.setZero();
      for (int k = 0; k < 4; ++k) {
        const PoseVector& factor =
            factor_[static_cast<std::size_t>(g)][static_cast<std::size_t>(k)];
        out += factor.cwiseProduct(Eigen::Map<const PoseVector>(parameters[k]));
        if (jacobians == nullptr || jacobians[k] == nullptr) continue;
        Eigen::Map<Eigen::Matrix<double, 12, 6, Eigen::RowMajor>> J(jacobians[k]);
        J.middleRows<6>(6 * g) = factor.asDiagonal();
      }
    }
    return true;
  }

 private:
  std::array<std::array<PoseVector, 4>, 2> factor_;
};

class KnowledgeCost : public ceres::SizedCostFunction<kLensParameterCount, kLensParameterCount> {
 public:
  explicit KnowledgeCost(const LensKnowledge& knowledge) : mean_(knowledge.mean) {
    // Residual L^T (lens - mean) with information = L L^T, which may be singular.
    const Eigen::LDLT<LensMatrix> ldlt(knowledge.information);
    const LensVector root = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
    LensMatrix L = ldlt.matrixL();
    L = ldlt.transpositionsP().transpose() * L;
    J_ = root.asDiagonal() * L.transpose();
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<LensVector> out(residuals);
    out = J_ * (Eigen::Map<const LensVector>(parameters[0]) - mean_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kLensParameterCount, kLensParameterCount, Eigen::RowMajor>>
          J(jacobians[0]);
      J = J_;
    }
    return true;
  }

 private:
  LensVector mean_;
  LensMatrix J_;
};

// Parameter and residual blocks of a problem.
struct Blocks {
  std::vector<double*> points;  // control points
  double* lens = nullptr;
  std::vector<ceres::ResidualBlockId> observations;
  std::vector<std::pair<int, int>> seen;  // frame and observation of each pair of residuals
};

// The state's control points and lens are the parameter blocks; spline is a copy that does not
// change.
Blocks build(const PatternData& data, const PatternMask& used, const LensKnowledge& knowledge,
             const PatternAdjustmentOptions& options, const PoseCurve& spline, PatternState* state,
             ceres::Problem* problem) {
  PoseCurve& curve = state->curve;
  Blocks blocks;
  blocks.lens = state->lens.data();
  for (int i = 0; i < curve.control_points(); ++i) {
    blocks.points.push_back(curve.control_point(i).data());
    problem->AddParameterBlock(blocks.points.back(), 6);
  }
  problem->AddParameterBlock(blocks.lens, kLensParameterCount);
  const auto point = [&](int i) { return blocks.points[static_cast<std::size_t>(i)]; };
  for (int s = 0; s < curve.segments(); ++s) {
    problem->AddResidualBlock(new AccelerationCost(spline, s, options), nullptr,
                              {point(s), point(s + 1), point(s + 2), point(s + 3)});
  }
  const double line_delay = state->lens[index(LensParameter::kLineDelay)];
  int hint = 0;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const PatternFrame& frame = data.frames[f];
    std::vector<std::vector<int>> members;  // by segment, from the least
    int first = std::numeric_limits<int>::max();
    std::vector<int> segment(frame.observations.size(), -1);
    int last = -1;
    for (std::size_t i = 0; i < frame.observations.size(); ++i) {
      if (used[f][i] == 0) continue;
      hint = spline.segment_at(frame.time_s + frame.observations[i].u.y() * line_delay, hint);
      segment[i] = hint;
      first = std::min(first, hint);
      last = std::max(last, hint);
    }
    for (int s = first; s <= last; ++s) {
      std::vector<int> in_segment;
      for (std::size_t i = 0; i < segment.size(); ++i) {
        if (segment[i] == s) in_segment.push_back(static_cast<int>(i));
      }
      if (in_segment.empty()) continue;
      for (const int i : in_segment) blocks.seen.emplace_back(static_cast<int>(f), i);
      blocks.observations.push_back(problem->AddResidualBlock(
          new FrameCost(&data, &spline, static_cast<int>(f), s, std::move(in_segment), options),
          nullptr, {point(s), point(s + 1), point(s + 2), point(s + 3), blocks.lens}));
    }
  }
  if (!knowledge.information.isZero()) {
    problem->AddResidualBlock(new KnowledgeCost(knowledge), nullptr, blocks.lens);
  }
  std::vector<int> fixed;
  for (int i = 0; i < kLensParameterCount; ++i) {
    if (knowledge.fixed[static_cast<std::size_t>(i)]) fixed.push_back(i);
  }
  if (fixed.size() == kLensParameterCount) {
    problem->SetParameterBlockConstant(blocks.lens);
  } else if (!fixed.empty()) {
    problem->SetManifold(blocks.lens, new ceres::SubsetManifold(kLensParameterCount, fixed));
  }
  return blocks;
}

using SparseRows = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>;

// Groups of observations whose errors may be correlated.
struct Groups {
  int count = 0;
  std::vector<int> of;  // group of each observation
};

// By time: blur, corners at the same places within their pixels. By part of the image: what the
// lens model lacks. By point: what detector or print get wrong there.
std::array<Groups, 3> groups_of(const PatternData& data, const Blocks& blocks) {
  constexpr int kStretches = 100;
  const ImageCells cells(data.width, data.height);
  const auto frames = static_cast<int>(data.frames.size());
  std::array<Groups, 3> groups;
  groups[0].count = std::min(kStretches, frames);
  groups[1].count = cells.count();
  groups[2].count = static_cast<int>(data.points_m.size());
  for (const auto& [f, i] : blocks.seen) {
    const PatternObservation& o =
        data.frames[static_cast<std::size_t>(f)].observations[static_cast<std::size_t>(i)];
    groups[0].of.push_back(static_cast<int>(static_cast<long long>(f) * groups[0].count / frames));
    groups[1].of.push_back(cells.cell_of(o.u));
    groups[2].of.push_back(o.point);
  }
  return groups;
}

// Factor of the lens's sigmas due to correlated errors, from the data. Each group of observations
// pulls at the lens by X^T J^T r. The spread of these pulls is a second estimate of the variance,
// which needs no independence within a group. It counts where it is larger beyond chance.
Eigen::VectorXd growth(const PatternData& data, const Blocks& blocks,
                       ceres::Problem::EvaluateOptions evaluate, const Eigen::MatrixXd& X,
                       const Eigen::MatrixXd& C, ceres::Problem* problem) {
  evaluate.residual_blocks = blocks.observations;
  ceres::CRSMatrix rows;
  std::vector<double> r;
  Eigen::VectorXd excess = Eigen::VectorXd::Zero(C.rows());
  if (!problem->Evaluate(evaluate, nullptr, &r, nullptr, &rows)) return excess.array() + 1;
  const SparseRows J(rows.num_rows, rows.num_cols, static_cast<Eigen::Index>(rows.values.size()),
                     rows.rows.data(), rows.cols.data(), rows.values.data());
  const Eigen::MatrixXd JX = J * X;
  const double freedom = static_cast<double>(JX.rows()) /
                         std::max<double>(1, static_cast<double>(JX.rows() - X.rows()));
  for (const Groups& groups : groups_of(data, blocks)) {
    Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(X.cols(), groups.count);
    for (Eigen::Index i = 0; i < JX.rows(); ++i) {
      pull.col(groups.of[static_cast<std::size_t>(i / 2)]) +=
          r[static_cast<std::size_t>(i)] * JX.row(i).transpose();
    }
    const double beyond_chance = 1 + 2.5 * std::sqrt(2.0 / groups.count);
    for (Eigen::Index i = 0; i < C.rows(); ++i) {
      const double ratio = freedom * pull.row(i).squaredNorm() / C(i, i);
      if (ratio > beyond_chance) excess[i] += ratio - 1;
    }
  }
  return (1 + excess.array()).sqrt();
}

}  // namespace

PoseVector mean_square_acceleration(const PoseCurve& curve) {
  PoseVector sum = PoseVector::Zero();
  for (int s = 0; s < curve.segments(); ++s) {
    for (const Moment& moment : moments_of(curve, s)) {
      const Vector4<double> weights = curve.acceleration_weights(s, moment.time_s);
      PoseVector a = PoseVector::Zero();
      for (int k = 0; k < 4; ++k) a += weights[k] * curve.control_point(s + k);
      sum += moment.weight_s * a.cwiseAbs2();
    }
  }
  return sum / (curve.end_s() - curve.begin_s());
}

AdjustmentEnd adjust_pattern(const PatternData& data, const PatternMask& used,
                             const LensKnowledge& knowledge,
                             const PatternAdjustmentOptions& options, PatternState* state) {
  const PoseCurve spline = state->curve;
  ceres::Problem problem;
  build(data, used, knowledge, options, spline, state, &problem);
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_steps;
  solver.initial_trust_region_radius = options.first_radius;
  solver.function_tolerance = options.relative_decrease;
  // A step of the line delay, 1e-7 s, is nothing beside focal lengths of hundreds of pixels.
  solver.parameter_tolerance = 0;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable() || !state->lens.allFinite()) return AdjustmentEnd::kFailed;
  return summary.termination_type == ceres::CONVERGENCE ? AdjustmentEnd::kConverged
                                                        : AdjustmentEnd::kOutOfSteps;
}

std::optional<LensCovariance> lens_covariance(const PatternData& data, const PatternMask& used,
                                              const LensKnowledge& knowledge,
                                              const PatternAdjustmentOptions& options,
                                              const PatternState& state) {
  std::vector<int> free;
  for (int i = 0; i < kLensParameterCount; ++i) {
    if (!knowledge.fixed[static_cast<std::size_t>(i)]) free.push_back(i);
  }
  LensCovariance result;
  if (free.empty()) return result;
  PatternState at = state;
  ceres::Problem problem;
  const Blocks blocks = build(data, used, knowledge, options, state.curve, &at, &problem);
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = blocks.points;
  evaluate.parameter_blocks.push_back(blocks.lens);
  ceres::CRSMatrix all;
  if (!problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &all)) return std::nullopt;
  const SparseRows J(all.num_rows, all.num_cols, static_cast<Eigen::Index>(all.values.size()),
                     all.rows.data(), all.cols.data(), all.values.data());
  // Columns are scaled to one length, as the parameters' units differ widely.
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(all.num_cols);
  for (std::size_t i = 0; i < all.values.size(); ++i)
    scale[all.cols[i]] += all.values[i] * all.values[i];
  scale = scale.cwiseSqrt().cwiseMax(1e-30).cwiseInverse();
  const Eigen::SparseMatrix<double> scaled = J * scale.asDiagonal();
  const Eigen::SparseMatrix<double> H = scaled.transpose() * scaled;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                              Eigen::NaturalOrdering<int>>
      ldlt(H);
  // Natural order: the curve's band, then the lens. The lens's pivots are the information about it
  // beside the curve.
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().array() > 1e-13).all()) return std::nullopt;
  const auto lens_begin = all.num_cols - static_cast<int>(free.size());
  // The lens's columns of the inverse.
  Eigen::MatrixXd X(all.num_cols, static_cast<Eigen::Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k) {
    Eigen::VectorXd unit = Eigen::VectorXd::Zero(all.num_cols);
    unit[lens_begin + static_cast<int>(k)] = scale[lens_begin + static_cast<int>(k)];
    X.col(static_cast<Eigen::Index>(k)) = scale.cwiseProduct(Eigen::VectorXd(ldlt.solve(unit)));
  }
  const Eigen::MatrixXd C = X.bottomRows(static_cast<Eigen::Index>(free.size()));
  const Eigen::VectorXd factor = growth(data, blocks, evaluate, X, C, &problem);
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.growth[free[i]] = factor[row];
    for (std::size_t k = 0; k < free.size(); ++k)
      result.independent(free[i], free[k]) = C(row, static_cast<Eigen::Index>(k));
  }
  return result;
}

}  // namespace alidade::internal

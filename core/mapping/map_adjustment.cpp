#include "core/mapping/map_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "core/mapping/map_costs.h"
#include "core/mapping/map_projection.h"
#include "core/mapping/match_graph.h"
#include "core/model/direction.h"

namespace alidade {
namespace {

using internal::HoldPriorCost;
using internal::kPictureBlock;
using internal::LensBendCost;
using internal::LensLevelCost;
using internal::MotionPriorCost;
using internal::PicturePriorCost;
using internal::SeenCost;

constexpr double kBend_sigmas = 2.5;  // where Huber's loss becomes linear
// Of the first picture, if nothing else fixes the base.
constexpr double kKeptOrientation_rad = 1e-7;

// The unknowns; the problem's parameter blocks point into it.
struct MapUnknowns {
  std::vector<Vector4<double>> pictures;  // xi, eps
  std::vector<Vector3<double>> d_start;
  std::vector<Vector4<double>> motions;    // change of the pictures' motions
  std::vector<Vector2<double>> landmarks;  // change of d_start
  LensCurve lens;
};

bool is_usable(const MapEvidence& evidence, const MapOptions& options) {
  const auto pictures = static_cast<int>(evidence.pictures.size());
  if (pictures == 0 || evidence.landmarks < 1 || options.lens.segments() < 1) return false;
  if (options.start && options.start->control_points() != options.lens.control_points()) {
    return false;
  }
  if (!((options.level_sigma.array() > 0).all() && (options.bend_sigma.array() > 0).all() &&
        options.hold_sigma > 0)) {
    return false;
  }
  const std::vector<LensQuantities>& sigmas = options.level_sigmas;
  if (!sigmas.empty() &&
      (sigmas.size() != static_cast<std::size_t>(options.lens.control_points()) ||
       !std::all_of(sigmas.begin(), sigmas.end(),
                    [](const LensQuantities& sigma) { return (sigma.array() > 0).all(); }))) {
    return false;
  }
  for (const MapPicture& picture : evidence.pictures) {
    if (!std::isfinite(picture.position) || !(picture.eps_sigma > 0) ||
        !all_finite(picture.R_start) || !all_finite(picture.motion.angular_velocity) ||
        !(picture.motion_sigma.array() >= 0).all() || !all_finite(picture.motion_sigma) ||
        picture.position < options.lens.begin_s() || picture.position > options.lens.end_s()) {
      return false;
    }
    if (!picture.telemetry) continue;
    const OrientationPrior& telemetry = *picture.telemetry;
    if (!all_finite(telemetry.R_base_from_camera) || !all_finite(telemetry.covariance) ||
        telemetry.covariance.llt().info() != Eigen::Success) {
      return false;
    }
  }
  return std::all_of(
      evidence.observations.begin(), evidence.observations.end(), [&](const MapObservation& seen) {
        return seen.picture >= 0 && seen.picture < pictures && seen.landmark >= 0 &&
               seen.landmark < evidence.landmarks && all_finite(seen.u) && seen.sigma_px > 0;
      });
}

// Start direction of each landmark: the mean of the largest set of its observations that agree; of
// length 0 if there is none. agrees: the observations in these means. Others take no part in the
// adjustment, as a landmark between two pictures that look apart may have no pixel in either.
std::vector<Vector3<double>> start_directions(const MapEvidence& evidence, const LensCurve& lens,
                                              double most_start_error, std::vector<bool>* agrees) {
  std::vector<Vector3<double>> seen_at;
  std::vector<std::vector<std::size_t>> of_landmark(static_cast<std::size_t>(evidence.landmarks));
  for (std::size_t i = 0; i < evidence.observations.size(); ++i) {
    const MapObservation& seen = evidence.observations[i];
    const MapPicture& picture = evidence.pictures[static_cast<std::size_t>(seen.picture)];
    Vector3<double> d = Vector3<double>::Zero();
    if (unproject_to_map(lens.camera_at(picture.position), picture.motion, picture.R_start, seen.u,
                         &d) == ProjectionStatus::kOk) {
      of_landmark[static_cast<std::size_t>(seen.landmark)].push_back(i);
    }
    seen_at.push_back(d);
  }
  agrees->assign(evidence.observations.size(), false);
  std::vector<Vector3<double>> out(of_landmark.size(), Vector3<double>::Zero());
  for (std::size_t j = 0; j < out.size(); ++j) {
    std::vector<std::size_t> best;
    for (const std::size_t a : of_landmark[j]) {
      std::vector<std::size_t> near;
      for (const std::size_t b : of_landmark[j]) {
        if ((seen_at[a] - seen_at[b]).norm() < most_start_error) near.push_back(b);
      }
      if (near.size() > best.size()) best = std::move(near);
      if (best.size() == of_landmark[j].size()) break;
    }
    for (const std::size_t i : best) {
      out[j] += seen_at[i];
      (*agrees)[i] = true;
    }
    if (!best.empty()) out[j].normalize();
  }
  return out;
}

// The used observations, of landmarks that two pictures or more see.
std::vector<bool> tied(const MapEvidence& evidence, const MapUnknowns& state,
                       std::vector<bool> used) {
  std::vector<int> count(state.d_start.size(), 0);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) ++count[static_cast<std::size_t>(evidence.observations[i].landmark)];
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto landmark = static_cast<std::size_t>(evidence.observations[i].landmark);
    if (count[landmark] < 2 || !(state.d_start[landmark].norm() > 0.5)) used[i] = false;
  }
  return used;
}

// Whether the picture's motion is adjusted. Without a line delay it is not seen.
bool has_open_motion(const MapPicture& picture) {
  return picture.motion.line_delay != 0 && !picture.motion_sigma.isZero(0);
}

// The problem and its parameter blocks, in the order of elimination.
struct MapProblem {
  ceres::Problem problem;
  std::vector<double*> landmarks;
  std::vector<double*> shared;  // pictures, control points, hold, motions that are adjusted
  std::size_t pictures = 0;
  std::size_t hold = 0;  // its place in `shared`
  std::vector<ceres::ResidualBlockId> seen;

  [[nodiscard]] std::size_t unknowns() const {
    return 2 * landmarks.size() + 4 * (shared.size() - 1) + 1;
  }
};

std::unique_ptr<MapProblem> build_problem(const MapEvidence& evidence, const MapOptions& options,
                                          const std::vector<bool>& used, double noise,
                                          MapUnknowns* state) {
  auto out = std::make_unique<MapProblem>();
  ceres::Problem& problem = out->problem;
  LensCurve& lens = state->lens;
  for (Vector4<double>& picture : state->pictures) out->shared.push_back(picture.data());
  out->pictures = out->shared.size();
  for (int i = 0; i < lens.control_points(); ++i) {
    out->shared.push_back(lens.control_point(i).data());
  }
  out->hold = out->shared.size();
  out->shared.push_back(&lens.hold());
  std::vector<bool> has_landmark(state->landmarks.size(), false);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const MapObservation& seen = evidence.observations[i];
    const auto landmark = static_cast<std::size_t>(seen.landmark);
    const auto at = static_cast<std::size_t>(seen.picture);
    const MapPicture& picture = evidence.pictures[at];
    if (!has_landmark[landmark]) {
      has_landmark[landmark] = true;
      out->landmarks.push_back(state->landmarks[landmark].data());
    }
    const int first = options.lens.basis_at(picture.position).segment;
    out->seen.push_back(problem.AddResidualBlock(
        new SeenCost(&picture, &options.lens, &state->d_start[landmark], seen),
        new ceres::HuberLoss(kBend_sigmas * noise),
        {state->pictures[at].data(), state->landmarks[landmark].data(),
         lens.control_point(first).data(), lens.control_point(first + 1).data(),
         lens.control_point(first + 2).data(), lens.control_point(first + 3).data(), &lens.hold(),
         state->motions[at].data()}));
  }
  const bool is_tied_to_base =
      std::any_of(evidence.pictures.begin(), evidence.pictures.end(),
                  [](const MapPicture& picture) { return picture.telemetry.has_value(); });
  for (std::size_t i = 0; i < evidence.pictures.size(); ++i) {
    const MapPicture& picture = evidence.pictures[i];
    std::optional<OrientationPrior> prior = picture.telemetry;
    if (!is_tied_to_base && i == 0) {
      prior = OrientationPrior{picture.R_start, Matrix3<double>::Identity() * kKeptOrientation_rad *
                                                    kKeptOrientation_rad};
    }
    problem.AddResidualBlock(new PicturePriorCost(picture.R_start, prior, picture.eps_sigma),
                             nullptr, state->pictures[i].data());
    double* const motion = state->motions[i].data();
    problem.AddResidualBlock(new MotionPriorCost(picture.motion_sigma), nullptr, motion);
    if (has_open_motion(picture)) {
      out->shared.push_back(motion);
    } else {
      problem.SetParameterBlockConstant(motion);
    }
  }
  for (int i = 0; i < lens.control_points(); ++i) {
    const LensQuantities& level = options.lens.control_point(i);
    const LensQuantities& sigma = options.level_sigmas.empty()
                                      ? options.level_sigma
                                      : options.level_sigmas[static_cast<std::size_t>(i)];
    problem.AddResidualBlock(new LensLevelCost(level, sigma), nullptr,
                             lens.control_point(i).data());
    if (i < 2) continue;
    const LensQuantities bend =
        options.lens.control_point(i - 2) - 2 * options.lens.control_point(i - 1) + level;
    problem.AddResidualBlock(new LensBendCost(bend, options.bend_sigma), nullptr,
                             lens.control_point(i - 2).data(), lens.control_point(i - 1).data(),
                             lens.control_point(i).data());
  }
  problem.AddResidualBlock(new HoldPriorCost(options.lens.hold(), options.hold_sigma), nullptr,
                           &lens.hold());
  return out;
}

// least_gain: relative decrease of the cost below which the solver stops.
bool solve(const MapOptions& options, double least_gain, MapProblem* map, bool* converged,
           int* steps) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* block : map->landmarks) ordering->AddElementToGroup(block, 0);
  // Within a group Ceres orders by address. So each kind has a group of its own, to be the same
  // each time.
  for (std::size_t i = 0; i < map->shared.size(); ++i) {
    const int group = i < map->pictures ? 1 : i < map->hold ? 2 : i == map->hold ? 3 : 4;
    ordering->AddElementToGroup(map->shared[i], group);
  }
  solver.linear_solver_ordering = ordering;
  solver.max_num_iterations = options.max_steps;
  solver.num_threads = std::max(1, options.threads);
  solver.function_tolerance = least_gain;
  // Angles of 1e-7 rad matter, beside centres of some pixels.
  solver.parameter_tolerance = 0;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &map->problem, &summary);
  *converged = summary.termination_type == ceres::CONVERGENCE;
  *steps += summary.num_successful_steps + summary.num_unsuccessful_steps;
  return summary.IsSolutionUsable();
}

// Squared residual of each observation in its sigmas; infinite if the state does not project it.
std::vector<double> squares_of(const MapEvidence& evidence, const MapOptions& options,
                               const MapUnknowns& state) {
  std::vector<double> out;
  const double hold = state.lens.hold();
  for (const MapObservation& seen : evidence.observations) {
    const auto at = static_cast<std::size_t>(seen.picture);
    const auto landmark = static_cast<std::size_t>(seen.landmark);
    const MapPicture& picture = evidence.pictures[at];
    const int first = options.lens.basis_at(picture.position).segment;
    const double* parameters[8] = {
        state.pictures[at].data(),
        state.landmarks[landmark].data(),
        state.lens.control_point(first).data(),
        state.lens.control_point(first + 1).data(),
        state.lens.control_point(first + 2).data(),
        state.lens.control_point(first + 3).data(),
        &hold,
        state.motions[at].data(),
    };
    Vector2<double> r;
    const bool is_seen = state.d_start[landmark].norm() > 0.5 &&
                         SeenCost(&picture, &options.lens, &state.d_start[landmark], seen)
                             .Evaluate(parameters, r.data(), nullptr);
    out.push_back(is_seen ? r.squaredNorm() : HUGE_VAL);
  }
  return out;
}

// How much larger residuals are than claimed, at least 1: from their median, corrected for the
// unknowns' share.
double noise_found(const std::vector<double>& squares, const std::vector<bool>& used,
                   std::size_t unknowns) {
  std::vector<double> of_used;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) of_used.push_back(squares[i]);
  }
  if (of_used.empty()) return 1;
  const auto middle = of_used.begin() + static_cast<std::ptrdiff_t>(of_used.size() / 2);
  std::nth_element(of_used.begin(), middle, of_used.end());
  const double rows = 2 * static_cast<double>(of_used.size());
  const double free = std::max(0.1, (rows - static_cast<double>(unknowns)) / rows);
  const double median_of_two = 2 * std::log(2.0);  // of a chi-square with two degrees of freedom
  return std::max(1.0, std::sqrt(*middle / (median_of_two * free)));
}

using SparseColumns = Eigen::SparseMatrix<double>;

// Of a matrix with blocks of 2x2 along its diagonal: each landmark has its own. False: singular.
bool invert_blocks(const SparseColumns& matrix, SparseColumns* inverse) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < matrix.cols(); i += 2) {
    Matrix2<double> block;
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) block(a, b) = matrix.coeff(i + a, i + b);
    }
    const Eigen::LDLT<Matrix2<double>> factors(block);
    if (factors.info() != Eigen::Success || !(factors.vectorD().array() > 0).all()) return false;
    const Matrix2<double> inverted = factors.solve(Matrix2<double>::Identity());
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) entries.emplace_back(i + a, i + b, inverted(a, b));
    }
  }
  inverse->resize(matrix.rows(), matrix.cols());
  inverse->setFromTriplets(entries.begin(), entries.end());
  return true;
}

// Covariance of the shared unknowns by the reduced normal matrix, and the residuals' scale. False
// if it is singular.
bool shared_covariance(MapProblem* map, Eigen::MatrixXd* covariance, double* noise_scale) {
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = map->landmarks;
  evaluate.parameter_blocks.insert(evaluate.parameter_blocks.end(), map->shared.begin(),
                                   map->shared.end());
  ceres::CRSMatrix all;
  if (!map->problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &all)) return false;
  const SparseColumns J = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      all.num_rows, all.num_cols, static_cast<Eigen::Index>(all.values.size()), all.rows.data(),
      all.cols.data(), all.values.data());
  const auto eliminated = static_cast<Eigen::Index>(2 * map->landmarks.size());
  const Eigen::Index kept = J.cols() - eliminated;
  const SparseColumns A = J.leftCols(eliminated);
  const SparseColumns B = J.rightCols(kept);
  SparseColumns inverse;
  if (!invert_blocks(A.transpose() * A, &inverse)) return false;
  const SparseColumns AB = A.transpose() * B;
  const SparseColumns eliminated_by = inverse * AB;
  const SparseColumns BB = B.transpose() * B;
  Eigen::MatrixXd S = BB;
  S -= SparseColumns(AB.transpose() * eliminated_by);
  // Columns are scaled to one length, as the units differ widely.
  const Eigen::VectorXd scale =
      Eigen::VectorXd(BB.diagonal()).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * S * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> factors(scaled);
  if (factors.info() != Eigen::Success) return false;
  const Eigen::VectorXd pivots = factors.matrixLLT().diagonal();
  if (!(pivots.array() > 1e-7).all()) return false;
  *covariance = scale.asDiagonal() * factors.solve(Eigen::MatrixXd::Identity(kept, kept)) *
                scale.asDiagonal();

  evaluate.residual_blocks = map->seen;
  std::vector<double> residuals;
  if (!map->problem.Evaluate(evaluate, nullptr, &residuals, nullptr, nullptr)) return false;
  double sum = 0;
  for (const double r : residuals) sum += r * r;
  const double freedom =
      std::max(1.0, static_cast<double>(residuals.size()) - static_cast<double>(J.cols()));
  *noise_scale = std::sqrt(sum / freedom);
  return covariance->allFinite() && std::isfinite(*noise_scale);
}

// Derivative of the pictures' (xi, log f) by the shared unknowns. There xi is of R_start Exp(xi),
// here of R Exp(xi).
Eigen::SparseMatrix<double> pictures_by_shared(const MapEvidence& evidence,
                                               const MapUnknowns& state, Eigen::Index shared) {
  const auto pictures = static_cast<Eigen::Index>(evidence.pictures.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < pictures; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Index row = kPictureBlock * i;
    const Matrix3<double> J = right_jacobian_so3(Vector3<double>(state.pictures[at].head<3>()));
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) entries.emplace_back(row + a, row + b, J(a, b));
    }
    entries.emplace_back(row + 3, row + 3, 1);
    const LensCurve::Basis basis = state.lens.basis_at(evidence.pictures[at].position);
    for (int k = 0; k < 4; ++k) {
      const Eigen::Index column =
          kPictureBlock * pictures + kLensQuantityCount * (basis.segment + k);
      entries.emplace_back(row + 3, column, basis.weight[k]);
    }
  }
  Eigen::SparseMatrix<double> out(kPictureBlock * pictures, shared);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

std::vector<SeenIn> seen_in(const MapEvidence& evidence, const std::vector<bool>& used) {
  std::vector<SeenIn> out;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const MapObservation& seen = evidence.observations[i];
    if (used[i]) out.emplace_back(seen.picture, seen.landmark);
  }
  return out;
}

void write_result(const MapEvidence& evidence, const std::vector<bool>& used,
                  const MapUnknowns& state, MapAdjustment* out) {
  out->lens = state.lens;
  for (std::size_t i = 0; i < evidence.pictures.size(); ++i) {
    const MapPicture& picture = evidence.pictures[i];
    const Vector4<double>& x = state.pictures[i];
    AdjustedPicture adjusted;
    adjusted.R_base_from_camera = picture.R_start * exp_so3(Vector3<double>(x.head<3>()));
    adjusted.eps = x[3];
    adjusted.camera = state.lens.camera_at(picture.position, x[3]);
    adjusted.motion = picture.motion;
    adjusted.motion.angular_velocity += state.motions[i].head<3>();
    adjusted.motion.zoom_rate += state.motions[i][3];
    out->pictures.push_back(adjusted);
  }
  out->landmarks.assign(state.landmarks.size(), Vector3<double>::Zero());
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) {
      out->left_out.push_back(static_cast<int>(i));
      continue;
    }
    const auto landmark = static_cast<std::size_t>(evidence.observations[i].landmark);
    out->landmarks[landmark] = direction_plus(state.d_start[landmark], state.landmarks[landmark]);
  }
}

}  // namespace

const char* to_string(MapStatus status) {
  switch (status) {
    case MapStatus::kOk:
      return "ok";
    case MapStatus::kBadInput:
      return "pictures, landmarks or options out of range";
    case MapStatus::kNotConnected:
      return "some pictures share too little with the others";
    case MapStatus::kNotDetermined:
      return "the pictures do not determine the map";
    case MapStatus::kNotConverged:
      return "the adjustment did not converge";
  }
  return "unknown status";
}

MapAdjustment adjust_map(const MapEvidence& evidence, const MapOptions& options) {
  MapAdjustment out;
  if (!is_usable(evidence, options)) return out;
  MapUnknowns state;
  state.pictures.assign(evidence.pictures.size(), Vector4<double>::Zero());
  state.motions.assign(evidence.pictures.size(), Vector4<double>::Zero());
  state.landmarks.assign(static_cast<std::size_t>(evidence.landmarks), Vector2<double>::Zero());
  state.lens = options.start.value_or(options.lens);
  std::vector<bool> agrees;
  state.d_start = start_directions(evidence, state.lens, options.most_start_error, &agrees);

  std::vector<bool> used = tied(evidence, state, agrees);
  const auto pictures = static_cast<int>(evidence.pictures.size());
  const auto hangs_together = [&] {
    out.groups = connected_pictures(pictures, seen_in(evidence, used), options.least_common);
    return out.groups.size() == 1;
  };
  double noise = 1;
  bool converged = false;
  // Outliers pull at the first rounds, which then converge slowly: these stop early and have a
  // wider gate.
  struct Round {
    double least_gain, gate;
  };
  for (const Round& round :
       {Round{1e-3, 3 * options.gate_sigmas}, Round{1e-5, options.gate_sigmas}}) {
    out.status = MapStatus::kNotConnected;
    if (!hangs_together()) return out;
    const auto map = build_problem(evidence, options, used, noise, &state);
    out.status = MapStatus::kNotDetermined;
    if (!solve(options, round.least_gain, map.get(), &converged, &out.steps)) return out;
    const std::vector<double> squares = squares_of(evidence, options, state);
    noise = noise_found(squares, used, map->unknowns());
    std::vector<bool> within;
    within.reserve(squares.size());
    for (const double square : squares) within.push_back(square < std::pow(round.gate * noise, 2));
    used = tied(evidence, state, within);
  }
  out.status = MapStatus::kNotConnected;
  if (!hangs_together()) return out;
  const auto map = build_problem(evidence, options, used, noise, &state);
  out.status = MapStatus::kNotDetermined;
  // What is left to gain is far below one sigma. Observations beyond the loss's bend converge
  // slowly.
  if (!solve(options, 1e-6, map.get(), &converged, &out.steps)) return out;
  Eigen::MatrixXd covariance;
  if (!shared_covariance(map.get(), &covariance, &out.noise_scale)) return out;
  out.status = MapStatus::kNotConverged;
  if (!converged) return out;
  const Eigen::SparseMatrix<double> G = pictures_by_shared(evidence, state, covariance.cols());
  const double inflation = std::max(1.0, out.noise_scale * out.noise_scale);
  const auto hold = static_cast<Eigen::Index>(kPictureBlock * map->hold);  // all before are of 4
  out.hold_sigma = std::sqrt(inflation * covariance(hold, hold));
  out.covariance = inflation * (G * covariance * G.transpose());
  write_result(evidence, used, state, &out);
  out.status = MapStatus::kOk;
  return out;
}

}  // namespace alidade

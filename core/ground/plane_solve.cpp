#include "core/ground/plane_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/model/rotation.h"

namespace alidade::internal {
namespace {

constexpr int kMostSteps = 100;

PlaneFrame frame_of(const PlaneEvidence& evidence) {
  int places = 0;
  bool has_heading = false;
  for (const PlaneDatum& datum : evidence.data) {
    if (datum.kind == PlaneDatumKind::kPlace || datum.kind == PlaneDatumKind::kPoint) ++places;
    if (datum.kind == PlaneDatumKind::kHeading || datum.kind == PlaneDatumKind::kBearing)
      has_heading = true;
  }
  if (places == 0) return has_heading ? PlaneFrame::kHeading : PlaneFrame::kCamera;
  // Two places determine a heading.
  const bool tells_heading = places > 1 || has_heading || evidence.y_is_north;
  return tells_heading ? PlaneFrame::kUser : PlaneFrame::kPlace;
}

bool residuals_of(const PlaneProblem& problem, const PlaneState& state,
                  std::vector<DatumResidual>* out) {
  if (!(state.plane.height() > 0)) return false;
  const std::vector<PlaneDatum>& data = problem.evidence.data;
  out->resize(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (!datum_residual(data[i], problem.roots, state, &(*out)[i]) && problem.counts(i))
      return false;
  }
  return true;
}

// With the covariances of `weights`.
double chi_square(const PlaneProblem& problem, const std::vector<DatumResidual>& residuals,
                  const std::vector<DatumResidual>& weights, const PlaneState& state) {
  double sum = state.looks.squaredNorm();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (!problem.counts(i)) continue;
    sum += residuals[i].r.dot(weights[i].covariance.inverse() * residuals[i].r);
  }
  return sum;
}

}  // namespace

PlaneProblem::PlaneProblem(const PlaneEvidence& given) : evidence(given), frame(frame_of(given)) {
  for (const Matrix3<double>& covariance : given.looks) {
    const SymmetricEigen eigen(Eigen::MatrixXd{covariance});
    roots.push_back(eigen.eigenvectors() *
                    eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal());
  }
}

PlaneUnknowns plane_unknowns(PlaneFrame frame, const WorldPlane& plane) {
  if (frame == PlaneFrame::kUser) return PlaneUnknowns::Identity(6, 6);
  const int count = frame == PlaneFrame::kCamera ? 3 : frame == PlaneFrame::kHeading ? 4 : 5;
  PlaneUnknowns out = PlaneUnknowns::Zero(6, count);
  out(0, 0) = out(1, 1) = out(5, 2) = 1;
  if (frame == PlaneFrame::kHeading) {
    out(2, 3) = 1;
  } else {
    if (frame == PlaneFrame::kPlace) out(3, 3) = out(4, 4) = 1;
    // The heading stays the same.
    const Vector3<double> J = heading_jacobian(plane);
    if (J.z() != 0) out.row(2).head<2>() = -J.head<2>().transpose() / J.z();
  }
  return out;
}

WorldPlane in_frame(PlaneFrame frame, const WorldPlane& plane) {
  WorldPlane out = plane;
  if (frame == PlaneFrame::kUser) return out;
  if (frame != PlaneFrame::kPlace) out.position.head<2>().setZero();
  if (frame != PlaneFrame::kHeading) {
    out.R_base_from_world =
        plane.R_base_from_world * rotation_about(Vector3<double>(0, 0, 1), -heading(plane));
  }
  return out;
}

Eigen::Matrix<double, 2, Eigen::Dynamic> full_jacobian(const PlaneDatum& datum,
                                                       const DatumResidual& residual,
                                                       const PlaneUnknowns& unknowns, int looks) {
  const Eigen::Index k = unknowns.cols();
  Eigen::Matrix<double, 2, Eigen::Dynamic> J(2, k + 3 * looks);
  J.setZero();
  J.leftCols(k) = residual.J_plane * unknowns;
  if (datum.sight.look >= 0) J.middleCols<3>(k + 3 * datum.sight.look) += residual.J_sight_look;
  if (datum.other.look >= 0) J.middleCols<3>(k + 3 * datum.other.look) += residual.J_other_look;
  return J;
}

std::optional<double> chi_square_after(const PlaneProblem& problem, const PlaneSolution& solution,
                                       const Eigen::VectorXd& change) {
  const Eigen::Index k = solution.unknowns.cols();
  const Eigen::Index z = change.size() - k;
  PlaneState state{plane_plus(solution.state.plane, solution.unknowns * change.head(k)),
                   solution.state.looks + change.tail(z)};
  state.plane = in_frame(problem.frame, state.plane);
  std::vector<DatumResidual> residuals;
  if (!residuals_of(problem, state, &residuals)) return std::nullopt;
  return chi_square(problem, residuals, solution.residuals, state);
}

bool solve_plane(const PlaneProblem& problem, const WorldPlane& start, PlaneSolution* out) {
  const int looks = static_cast<int>(problem.roots.size());
  PlaneState state{in_frame(problem.frame, start), Eigen::VectorXd::Zero(3 * looks)};
  std::vector<DatumResidual> residuals;
  if (!residuals_of(problem, state, &residuals)) return false;
  double damping = 1e-3;
  bool rests = false;
  int steps = 0;
  PlaneUnknowns unknowns;
  Eigen::MatrixXd A;
  std::vector<DatumResidual> tried_residuals;
  for (; steps < kMostSteps && !rests; ++steps) {
    unknowns = plane_unknowns(problem.frame, state.plane);
    const Eigen::Index k = unknowns.cols();
    A = Eigen::MatrixXd::Zero(k + 3 * looks, k + 3 * looks);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(A.rows());
    A.diagonal().tail(3 * looks).setOnes();
    b.tail(3 * looks) = -state.looks;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (!problem.counts(i)) continue;
      const auto J = full_jacobian(problem.evidence.data[i], residuals[i], unknowns, looks);
      const Matrix2<double> W = residuals[i].covariance.inverse();
      A.noalias() += J.transpose() * W * J;
      b.noalias() -= J.transpose() * (W * residuals[i].r);
    }
    const double before = chi_square(problem, residuals, residuals, state);
    if (!std::isfinite(before)) return false;
    bool accepted = false;
    while (!accepted && damping < 1e12) {
      Eigen::MatrixXd damped = A;
      // A free direction gets a damping of its own, as it has no information.
      damped.diagonal() +=
          damping * (A.diagonal().array() + 1e-12 * A.diagonal().maxCoeff()).matrix();
      const Eigen::VectorXd step = damped.ldlt().solve(b);
      // A millionth of a sigma, squared.
      if (step.dot(A * step) < 1e-12) {
        rests = true;
        break;
      }
      PlaneState tried{plane_plus(state.plane, unknowns * step.head(k)),
                       state.looks + step.tail(3 * looks)};
      tried.plane = in_frame(problem.frame, tried.plane);
      accepted = residuals_of(problem, tried, &tried_residuals) &&
                 chi_square(problem, tried_residuals, residuals, tried) <= before;
      if (accepted) {
        state = tried;
        residuals.swap(tried_residuals);
      }
      damping = accepted ? std::max(damping / 10, 1e-12) : damping * 10;
    }
    // If no step helps, the rest is rounding.
    if (!accepted) break;
  }
  if (!rests && steps == kMostSteps) return false;
  out->chi_square = chi_square(problem, residuals, residuals, state);
  out->objective = out->chi_square;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (problem.counts(i)) out->objective += std::log(residuals[i].covariance.determinant());
  }
  out->state = state;
  out->residuals = residuals;
  out->unknowns = unknowns;
  out->information = A;
  out->steps = steps;
  return std::isfinite(out->objective);
}

}  // namespace alidade::internal

#include "core/ground/plane_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/ground/plane_solve.h"
#include "core/ground/plane_start.h"

namespace alidade {

using internal::DatumResidual;
using internal::PlaneFrame;
using internal::PlaneProblem;
using internal::PlaneSolution;

namespace {

constexpr int kMostStarts = 12;
// Share of a residual's variance that must be left for other data to have checked it.
constexpr double kLeastChecked = 0.01;

bool is_sight_good(const PlaneSight& sight, std::size_t looks) {
  const Matrix2<double>& cov = sight.covariance;
  return all_finite(sight.d_b) && std::abs(sight.d_b.norm() - 1) < 1e-6 && all_finite(cov) &&
         cov(0, 0) > 0 && cov.determinant() > 0 && sight.look < static_cast<int>(looks);
}

bool uses_sight(PlaneDatumKind kind) {
  return kind == PlaneDatumKind::kPoint || kind == PlaneDatumKind::kHorizon ||
         kind == PlaneDatumKind::kBearing || kind == PlaneDatumKind::kVertical;
}

bool uses_two_sights(PlaneDatumKind kind) {
  return kind == PlaneDatumKind::kLength || kind == PlaneDatumKind::kUpright;
}

bool is_length(PlaneDatumKind kind) {
  return uses_two_sights(kind) || kind == PlaneDatumKind::kHeight;
}

std::string fault_of(const PlaneDatum& datum, std::size_t looks) {
  if (!(datum.sigma > 0) || !(datum.place_sigma.minCoeff() > 0) || !std::isfinite(datum.sigma) ||
      !all_finite(datum.place_sigma)) {
    return "its sigma is not above 0";
  }
  if (!std::isfinite(datum.value) || !all_finite(datum.place)) return "it is not finite";
  if (is_length(datum.kind) && !(datum.value > 0)) return "its length is not above 0";
  const bool two = uses_two_sights(datum.kind);
  if ((uses_sight(datum.kind) || two) && !is_sight_good(datum.sight, looks))
    return "its direction has no unit length or no positive covariance";
  if (two && !is_sight_good(datum.other, looks))
    return "its second direction has no unit length or no positive covariance";
  return "";
}

PlaneFit refused(PlaneFitStatus status, std::string message) {
  PlaneFit out;
  out.status = status;
  out.message = std::move(message);
  return out;
}

// Whether the points lie in one line, to a thousandth of their extent.
bool points_in_a_line(const PlaneEvidence& evidence) {
  Vector3<double> mean = Vector3<double>::Zero();
  int count = 0;
  for (const PlaneDatum& datum : evidence.data) {
    if (datum.kind != PlaneDatumKind::kPoint) continue;
    mean += datum.place;
    ++count;
  }
  if (count < 2) return false;
  mean /= count;
  Eigen::MatrixXd sum = Matrix3<double>::Zero();
  for (const PlaneDatum& datum : evidence.data) {
    if (datum.kind == PlaneDatumKind::kPoint)
      sum += (datum.place - mean) * (datum.place - mean).transpose();
  }
  const internal::SymmetricEigen eigen(sum, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[1] < 1e-6 * eigen.eigenvalues()[2];
}

struct BestSolution {
  std::optional<PlaneSolution> best;
  bool ambiguous = false;
};

bool differ(const PlaneSolution& a, const PlaneSolution& b) {
  const Matrix<double, kPlaneParameterCount, 1> off = plane_minus(a.state.plane, b.state.plane);
  const double scale = std::max(b.state.plane.height(), 1e-6);
  return off.head<3>().norm() > 1e-2 || off.tail<3>().norm() > 1e-2 * scale;
}

BestSolution solve_all(const PlaneProblem& problem, const WorldPlane* also = nullptr) {
  std::vector<WorldPlane> starts = internal::plane_starts(problem, kMostStarts);
  if (also != nullptr) starts.insert(starts.begin(), *also);
  std::vector<PlaneSolution> found;
  for (const WorldPlane& start : starts) {
    PlaneSolution solution;
    if (solve_plane(problem, start, &solution)) found.push_back(solution);
  }
  BestSolution out;
  for (const PlaneSolution& solution : found) {
    if (!out.best || solution.objective < out.best->objective) out.best = solution;
  }
  if (!out.best) return out;
  // Solutions less likely than the best by e^-6 at most are taken as equally good.
  const double limit = out.best->objective + 12;
  const auto stands_upright = [](const PlaneSolution& s) { return s.state.plane.up_b().z() < 0; };
  if (!stands_upright(*out.best)) {
    for (const PlaneSolution& solution : found) {
      const bool better = !stands_upright(*out.best) || solution.objective < out.best->objective;
      if (solution.objective < limit && stands_upright(solution) && better) out.best = solution;
    }
  }
  for (const PlaneSolution& solution : found) {
    if (solution.objective < limit && differ(solution, *out.best) &&
        stands_upright(solution) == stands_upright(*out.best)) {
      out.ambiguous = true;
    }
  }
  return out;
}

// Information of the plane's unknowns alone, looks eliminated.
Eigen::MatrixXd plane_information(const PlaneSolution& solution) {
  const Eigen::Index k = solution.unknowns.cols();
  const Eigen::Index z = solution.information.rows() - k;
  Eigen::MatrixXd out = solution.information.topLeftCorner(k, k);
  if (z > 0) {
    out -= solution.information.topRightCorner(k, z) *
           solution.information.bottomRightCorner(z, z).ldlt().solve(
               solution.information.bottomLeftCorner(z, k));
  }
  return out;
}

const char* how_to_hold(const std::string& what) {
  if (what == "tilt")
    return "give the base's level, points of the horizon, upright targets or known points in other "
           "directions";
  if (what == "heading") return "give a heading, a bearing or another known point";
  if (what == "height")
    return "give the camera's height, or a length or an upright target nearer to the camera";
  return "give the camera's place or another known point";
}

// Length by which a direction's error counts: distance of the farthest point, or the height.
double length_scale(const PlaneEvidence& evidence, const WorldPlane& plane) {
  double scale = plane.height();
  for (const PlaneDatum& datum : evidence.data) {
    if (datum.kind == PlaneDatumKind::kPoint)
      scale = std::max(scale, (datum.place - plane.position).norm());
  }
  return scale;
}

// Which parts of the plane a change of (xi, p) moves most; lengths in `scale`.
std::string moved_most(const Matrix<double, kPlaneParameterCount, 1>& change, double scale) {
  const std::vector<std::pair<std::string, double>> parts = {
      {"tilt", change.head<2>().norm()},
      {"heading", std::abs(change[2])},
      {"place", change.segment<2>(3).norm() / scale},
      {"height", std::abs(change[5]) / scale}};
  std::string what;
  double most = 0;
  for (const auto& [name, size] : parts) most = std::max(most, size);
  for (const auto& [name, size] : parts) {
    if (size > 0.3 * most) what += (what.empty() ? "" : " and ") + name;
  }
  return what;
}

PlaneFit undetermined(const PlaneEvidence& evidence, const std::string& what) {
  if (points_in_a_line(evidence) && what.find("tilt") != std::string::npos) {
    return refused(PlaneFitStatus::kUndetermined,
                   "the known points lie on a line, about which the plane can still turn; give "
                   "a point beside the line, or the base's level");
  }
  const std::string first = what.substr(0, what.find(' '));
  return refused(PlaneFitStatus::kUndetermined, what + (what == first ? " is" : " are") +
                                                    " not determined: " + how_to_hold(first));
}

// Sets the plane's covariance. False, with a refusal in *out, if something is free or too
// uncertain.
bool set_covariance(const PlaneEvidence& evidence, const PlaneFitOptions& options,
                    const PlaneSolution& solution, PlaneFit* out) {
  const Eigen::MatrixXd information = plane_information(solution);
  const internal::PlaneUnknowns& N = solution.unknowns;
  const double height = solution.state.plane.height();
  const double scale = length_scale(evidence, solution.state.plane);
  // Lengths are scaled, so that directions can be compared.
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(N.cols());
  for (Eigen::Index i = 0; i < N.cols(); ++i) {
    if (!N.col(i).tail<3>().isZero(0)) unit[i] = scale;
  }
  const Eigen::MatrixXd scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const internal::SymmetricEigen eigen(scaled);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const Eigen::VectorXd weakest = unit.cwiseProduct(eigen.eigenvectors().col(0));
  if (!(values[0] > 1e-6) || !(values[0] > 1e-13 * values[values.size() - 1])) {
    *out = undetermined(evidence, moved_most(N * weakest, scale));
    return false;
  }
  const Eigen::MatrixXd inverse =
      eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  const internal::PlaneUnknowns to_plane = N * unit.asDiagonal();
  out->plane.covariance = to_plane * inverse * to_plane.transpose();
  const auto sigma = out->plane.covariance.diagonal().cwiseMax(0.0).cwiseSqrt().eval();
  if (sigma[5] > options.most_height_share * height) {
    if (height < 0.01 * scale) {
      *out = refused(PlaneFitStatus::kCameraOnPlane,
                     "the plane goes through the camera, which sees it edge-on");
    } else {
      *out = undetermined(evidence, "height");
    }
    return false;
  }
  if (sigma.head<2>().maxCoeff() > options.most_tilt_sigma) {
    *out = undetermined(evidence, "tilt");
    return false;
  }
  if (sigma[2] > options.most_heading_sigma && !out->heading_of_base) {
    *out = undetermined(evidence, "heading");
    return false;
  }
  return true;
}

// Whether chi-square grows by about 9 at three sigmas along each axis of the covariance: by more
// than 4 and less than 20.25. If another solution is near it does not, and neither sigmas nor plane
// can be trusted.
bool grows_evenly(const PlaneProblem& problem, const PlaneSolution& solution) {
  const Eigen::MatrixXd covariance = solution.information.ldlt().solve(
      Eigen::MatrixXd::Identity(solution.information.rows(), solution.information.cols()));
  const Eigen::Index k = solution.unknowns.cols();
  const double scale = length_scale(problem.evidence, solution.state.plane);
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    if (!solution.unknowns.col(i).tail<3>().isZero(0)) unit[i] = scale;
  }
  const Eigen::MatrixXd scaled = unit.cwiseInverse().asDiagonal() * covariance.topLeftCorner(k, k) *
                                 unit.cwiseInverse().asDiagonal();
  const internal::SymmetricEigen eigen(scaled);
  for (Eigen::Index axis = 0; axis < k; ++axis) {
    // The looks follow as the information has it.
    const Eigen::VectorXd direction = eigen.eigenvectors().col(axis).cwiseQuotient(unit);
    const Eigen::VectorXd step =
        covariance.leftCols(k) * direction / std::sqrt(eigen.eigenvalues()[axis]);
    for (const double sigmas : {-3.0, 3.0}) {
      const auto there = chi_square_after(problem, solution, sigmas * step);
      const double growth = there ? *there - solution.chi_square : 0;
      if (!(growth > 4 && growth < 20.25)) return false;
    }
  }
  return true;
}

// Baarda: each residual by its own covariance after the fit. Returns r^T Q^+ r of each datum; 0 if
// nothing checks it.
std::vector<double> set_misfits(const PlaneProblem& problem, const PlaneSolution& solution,
                                PlaneFit* out) {
  std::vector<double> squares;
  const int looks = static_cast<int>(problem.roots.size());
  const Eigen::LDLT<Eigen::MatrixXd> information(solution.information);
  for (std::size_t i = 0; i < solution.residuals.size(); ++i) {
    const DatumResidual& residual = solution.residuals[i];
    const auto J = full_jacobian(problem.evidence.data[i], residual, solution.unknowns, looks);
    const Eigen::LLT<Matrix2<double>> own(residual.covariance);
    const Eigen::Matrix<double, 2, Eigen::Dynamic> J_white = own.matrixL().solve(J);
    const Vector2<double> r_white = own.matrixL().solve(residual.r);
    const Eigen::MatrixXd left =
        Matrix2<double>::Identity() - J_white * information.solve(J_white.transpose());
    const internal::SymmetricEigen eigen(left);
    DatumFit fit;
    double square = 0;
    int rank = 0;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector2<double> direction = eigen.eigenvectors().col(axis);
      // With size 1 the second row is no datum.
      if (residual.size == 1 && std::abs(direction[1]) > 0.5) continue;
      const double part = eigen.eigenvalues()[axis];
      fit.checked += std::max(part, 0.0) / residual.size;
      if (part < kLeastChecked) continue;
      const double along = direction.dot(r_white);
      square += along * along / part;
      ++rank;
    }
    if (rank > 0) fit.misfit = std::sqrt(square / rank);
    out->data.push_back(fit);
    squares.push_back(square);
  }
  return squares;
}

// The datum without which the others agree best; -1 if none is beyond the gate.
int find_gross(const PlaneProblem& problem, const PlaneSolution& solution,
               const std::vector<double>& squares, double gate) {
  std::vector<std::pair<double, int>> suspects;
  bool gross = false;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    gross = gross || squares[i] > gate * gate;
    if (squares[i] > 0) suspects.emplace_back(squares[i], static_cast<int>(i));
  }
  if (!gross) return -1;
  std::sort(suspects.begin(), suspects.end(), std::greater<>());
  if (suspects.size() > 8) suspects.resize(8);
  int worst = suspects.front().second;
  double best = solution.objective;
  for (const auto& [square, i] : suspects) {
    PlaneProblem without = problem;
    without.left_out = i;
    const BestSolution rest = solve_all(without, &solution.state.plane);
    if (!rest.best || !(rest.best->objective < best)) continue;
    best = rest.best->objective;
    worst = i;
  }
  return worst;
}

// 99.9 % point of chi-square per degree of freedom (Wilson and Hilferty).
double chance_limit(int degrees) {
  const double part = 2.0 / (9.0 * degrees);
  const double root = 1 - part + 3.09 * std::sqrt(part);
  return root * root * root;
}

bool has_scale(const PlaneEvidence& evidence) {
  return std::any_of(evidence.data.begin(), evidence.data.end(), [](const PlaneDatum& datum) {
    return is_length(datum.kind) || datum.kind == PlaneDatumKind::kPoint;
  });
}

}  // namespace

bool PlaneFitOptions::validate(const char** error) const {
  if (gate_sigmas > 0 && most_tilt_sigma > 0 && most_heading_sigma > 0 && most_height_share > 0)
    return true;
  *error = "a limit is not above 0";
  return false;
}

const char* to_string(PlaneFitStatus status) {
  switch (status) {
    case PlaneFitStatus::kOk:
      return "ok";
    case PlaneFitStatus::kBadInput:
      return "bad input";
    case PlaneFitStatus::kNoScale:
      return "no scale";
    case PlaneFitStatus::kUndetermined:
      return "not determined";
    case PlaneFitStatus::kCameraOnPlane:
      return "the plane goes through the camera";
    case PlaneFitStatus::kAmbiguous:
      return "ambiguous";
    case PlaneFitStatus::kMisfit:
      return "a datum does not fit";
    case PlaneFitStatus::kNoSolution:
      return "no solution";
  }
  return "unknown status";
}

PlaneFit fit_plane(const PlaneEvidence& evidence, const PlaneFitOptions& options) {
  const char* error = nullptr;
  if (!options.validate(&error)) return refused(PlaneFitStatus::kBadInput, error);
  for (const PlaneDatum& datum : evidence.data) {
    const std::string fault = fault_of(datum, evidence.looks.size());
    if (!fault.empty()) return refused(PlaneFitStatus::kBadInput, datum.name + ": " + fault);
  }
  if (!has_scale(evidence)) {
    return refused(PlaneFitStatus::kNoScale,
                   "nothing gives the scale: give the camera's height, a known point, a length "
                   "or an upright target");
  }
  const PlaneProblem problem(evidence);
  const BestSolution found = solve_all(problem);
  if (!found.best) {
    return refused(PlaneFitStatus::kNoSolution,
                   "no plane was found that all data can lie on: is a foot, or an end of a "
                   "length, above the horizon?");
  }
  const PlaneSolution& solution = *found.best;
  PlaneFit out;
  out.plane = solution.state.plane;
  out.origin_below_camera =
      problem.frame == PlaneFrame::kCamera || problem.frame == PlaneFrame::kHeading;
  out.heading_of_base = problem.frame == PlaneFrame::kCamera || problem.frame == PlaneFrame::kPlace;
  if (!set_covariance(evidence, options, solution, &out)) return out;
  if (found.ambiguous || !grows_evenly(problem, solution)) {
    return refused(PlaneFitStatus::kAmbiguous,
                   "another plane fits equally well: give the base's level or another known point");
  }
  const std::vector<double> squares = set_misfits(problem, solution, &out);
  out.chi_square = solution.chi_square;
  for (const DatumResidual& residual : solution.residuals) out.degrees_of_freedom += residual.size;
  out.degrees_of_freedom -= static_cast<int>(solution.unknowns.cols());
  if (out.degrees_of_freedom > 0) {
    const double ratio = out.chi_square / out.degrees_of_freedom;
    out.noise_scale = std::sqrt(ratio);
    if (ratio > chance_limit(out.degrees_of_freedom)) out.plane.covariance *= ratio;
  }
  out.worst = find_gross(problem, solution, squares, options.gate_sigmas);
  out.status = out.worst < 0 ? PlaneFitStatus::kOk : PlaneFitStatus::kMisfit;
  if (out.worst >= 0) {
    out.message = evidence.data[static_cast<std::size_t>(out.worst)].name +
                  " does not fit: the others agree best without it; correct it or leave it out";
  }
  return out;
}

}  // namespace alidade

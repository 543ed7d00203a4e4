#pragma once
// Least squares of a plane from one start: Levenberg-Marquardt with the weights of the data, which depend on the plane, held during a
// step and renewed with each: where it rests, J^T C^-1 r = 0 for C there.
//   least   sum r_i^T C_i^-1 r_i + |z|^2     over the plane's unknowns and the looks z (plane_residual.h)
// Unknown are all six of (xi, p) where data tie the camera to w. Where none does, w is the camera's (world_plane.h): three are
// unknown, or four where a heading is known and no place, or five where one place is known and no heading.

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <optional>
#include <vector>

#include "core/ground/plane_residual.h"

namespace alidade::internal {

// Of matrices of any size: each size of its own would cost seconds of compilation.
using SymmetricEigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

enum class PlaneFrame {
  kCamera,   // origin below it, Y below the base's forward direction
  kHeading,  // origin below it, headings as the data count them
  kPlace,    // as the data's one place has it, Y below the base's forward direction
  kUser      // as the data's places have it
};

struct PlaneProblem {
  const PlaneEvidence& evidence;
  std::vector<Matrix3<double>> roots;
  PlaneFrame frame = PlaneFrame::kCamera;
  int left_out = -1;  // a datum that does not count; -1: all do

  explicit PlaneProblem(const PlaneEvidence& given);
  [[nodiscard]] bool counts(std::size_t datum) const { return left_out != static_cast<int>(datum); }
};

// What of (xi, p) may change: a column each.
using PlaneUnknowns = Eigen::Matrix<double, kPlaneParameterCount, Eigen::Dynamic, 0,
                                    kPlaneParameterCount, kPlaneParameterCount>;
[[nodiscard]] PlaneUnknowns plane_unknowns(PlaneFrame frame, const WorldPlane& plane);

// The plane in the frame of the camera, where that is what w is.
[[nodiscard]] WorldPlane in_frame(PlaneFrame frame, const WorldPlane& plane);

struct PlaneSolution {
  PlaneState state;
  std::vector<DatumResidual> residuals;  // of all data, also of one left out if it can be said
  PlaneUnknowns unknowns;
  Eigen::MatrixXd information;  // by unknowns, then z
  double chi_square = 0;
  double objective = 0;  // chi-square and the logarithms of the weights: what ranks solutions
  int steps = 0;
};

// False: a datum means nothing at the start, or no rest was found.
[[nodiscard]] bool solve_plane(const PlaneProblem& problem, const WorldPlane& start,
                               PlaneSolution* out);

// Chi-square after a change of (unknowns, z), by the solution's weights. Nothing: a datum means nothing there.
[[nodiscard]] std::optional<double> chi_square_after(const PlaneProblem& problem,
                                                     const PlaneSolution& solution,
                                                     const Eigen::VectorXd& change);

// d residual / d (unknowns, z).
[[nodiscard]] Eigen::Matrix<double, 2, Eigen::Dynamic> full_jacobian(const PlaneDatum& datum,
                                                                     const DatumResidual& residual,
                                                                     const PlaneUnknowns& unknowns,
                                                                     int looks);

}  // namespace alidade::internal

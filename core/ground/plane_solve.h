#pragma once
// solve_plane(): least squares of a plane from one start, by Levenberg-Marquardt. Minimises
//   sum r_i^T C_i^-1 r_i + |z|^2     over the plane's unknowns and the looks z (plane_residual.h)
// The weights C_i^-1 depend on the plane. They are held during a step and renewed after it, so at
// the end J^T C^-1 r = 0 with the C of the solution.
// If data tie the camera to w, all six of (xi, p) are unknown. Otherwise the camera defines w
// (world_plane.h), and three are unknown; four with a known heading and no place; five with one
// known place and no heading. Allocates.

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <optional>
#include <vector>

#include "core/ground/plane_residual.h"

namespace alidade::internal {

// For matrices of any size: another type for each size would cost seconds of compilation.
using SymmetricEigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

enum class PlaneFrame {
  kCamera,   // origin below the camera, Y below the base's forward direction
  kHeading,  // origin below the camera, headings as the data count them
  kPlace,    // origin by the data's one place, Y below the base's forward direction
  kUser      // by the data's places
};

struct PlaneProblem {
  const PlaneEvidence& evidence;       // must outlive this object, and must not change
  std::vector<Matrix3<double>> roots;  // rad; square root of each look's covariance
  PlaneFrame frame = PlaneFrame::kCamera;
  int left_out = -1;  // a datum that is ignored; -1: none

  explicit PlaneProblem(const PlaneEvidence& given);
  [[nodiscard]] bool counts(std::size_t datum) const { return left_out != static_cast<int>(datum); }
};

// Columns: the allowed changes of (xi, p).
using PlaneUnknowns = Eigen::Matrix<double, kPlaneParameterCount, Eigen::Dynamic, 0,
                                    kPlaneParameterCount, kPlaneParameterCount>;
[[nodiscard]] PlaneUnknowns plane_unknowns(PlaneFrame frame, const WorldPlane& plane);

// The plane in the frame that `frame` names: with p_x and p_y of 0 if the origin is below the
// camera, and heading 0 if the base defines it.
[[nodiscard]] WorldPlane in_frame(PlaneFrame frame, const WorldPlane& plane);

struct PlaneSolution {
  PlaneState state;
  std::vector<DatumResidual> residuals;  // of all data; of the one left out only if it is defined
  PlaneUnknowns unknowns;
  Eigen::MatrixXd information;  // of the unknowns, then z
  double chi_square = 0;
  double objective = 0;  // chi-square and the logarithms of the weights; ranks solutions
  int steps = 0;
};

// False: the start's camera is not above the plane, a datum is not defined at the start, or there
// was no convergence.
[[nodiscard]] bool solve_plane(const PlaneProblem& problem, const WorldPlane& start,
                               PlaneSolution* out);

// Chi-square after a change of (unknowns, z), with the solution's weights. Empty if a datum is not
// defined after the change.
[[nodiscard]] std::optional<double> chi_square_after(const PlaneProblem& problem,
                                                     const PlaneSolution& solution,
                                                     const Eigen::VectorXd& change);

// d residual / d (unknowns, z). looks: their number; z has three elements for each.
[[nodiscard]] Eigen::Matrix<double, 2, Eigen::Dynamic> full_jacobian(const PlaneDatum& datum,
                                                                     const DatumResidual& residual,
                                                                     const PlaneUnknowns& unknowns,
                                                                     int looks);

}  // namespace alidade::internal

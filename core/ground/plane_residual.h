#pragma once
// One datum's residual (m or rad, as the datum) and its derivatives by the plane and every error.
//   height, place    p minus the datum
//   heading          heading minus the datum, wrapped
//   level            up minus the datum, in its tangent basis
//   vertical         up or down, whichever is nearer, minus the sight, in its tangent basis
//   horizon          the direction's elevation
//   point, bearing   direction minus the sight, in its tangent basis
//   length           distance of the two places minus the datum
//   upright          direction of (foot's place, height) minus the head's sight, in its basis

#include <Eigen/Core>
#include <vector>

#include "core/ground/plane_evidence.h"
#include "core/ground/world_plane.h"

namespace alidade::internal {

// Looks (plane_evidence.h) are unknowns besides the plane: turn = root z, z of unit variance, root
// root^T the look's covariance.
struct PlaneState {
  WorldPlane plane;
  Eigen::VectorXd looks;  // z; three for each look
};

// If size is 1, the second row is 0 and its variance is 1.
struct DatumResidual {
  int size = 2;  // numbers in r: 1 or 2
  Vector2<double> r = Vector2<double>::Zero();
  Matrix<double, 2, kPlaneParameterCount> J_plane = Matrix<double, 2, kPlaneParameterCount>::Zero();
  Matrix<double, 2, 3> J_sight_look = Matrix<double, 2, 3>::Zero();  // by z of the sight's look
  Matrix<double, 2, 3> J_other_look = Matrix<double, 2, 3>::Zero();  // by z of the other's look
  Matrix2<double> covariance = Matrix2<double>::Identity();          // from the datum's own errors
};

// roots: of the looks' covariances; every look of the datum must have one, and three elements of
// state.looks. False: the datum is not defined on this plane, such as a foot above the horizon;
// *out is then not to be used.
[[nodiscard]] bool datum_residual(const PlaneDatum& datum,
                                  const std::vector<Matrix3<double>>& roots,
                                  const PlaneState& state, DatumResidual* out);

}  // namespace alidade::internal

#include "core/ground/plane_residual.h"

#include <cmath>

#include "core/model/angle.h"
#include "core/model/direction.h"
#include "core/model/rotation.h"

namespace alidade {

const char* to_string(PlaneDatumKind kind) {
  switch (kind) {
    case PlaneDatumKind::kHeight:
      return "camera height";
    case PlaneDatumKind::kPlace:
      return "camera place";
    case PlaneDatumKind::kLevel:
      return "level";
    case PlaneDatumKind::kHeading:
      return "heading";
    case PlaneDatumKind::kPoint:
      return "point";
    case PlaneDatumKind::kHorizon:
      return "horizon";
    case PlaneDatumKind::kBearing:
      return "bearing";
    case PlaneDatumKind::kVertical:
      return "vertical";
    case PlaneDatumKind::kLength:
      return "length";
    case PlaneDatumKind::kUpright:
      return "upright target";
  }
  return "unknown datum";
}

PlaneDatum base_level(double pitch_rad, double roll_rad, double sigma_rad) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kLevel;
  out.name = "level";
  out.place = R_base_from_world_of(0, pitch_rad, roll_rad).col(2);
  out.sigma = sigma_rad;
  return out;
}

namespace internal {
namespace {

using PlaneRow3 = Matrix<double, 3, kPlaneParameterCount>;

// A sight corrected by its look's current error. Propagates errors of the direction to the
// residual.
struct TrueSight {
  const PlaneSight& sight;
  Matrix3<double> root = Matrix3<double>::Zero();
  Vector3<double> d_b;

  TrueSight(const PlaneSight& seen, const std::vector<Matrix3<double>>& roots,
            const PlaneState& state)
      : sight(seen), d_b(seen.d_b) {
    if (seen.look < 0) return;
    root = roots[static_cast<std::size_t>(seen.look)];
    const Vector3<double> z = state.looks.segment<3>(3 * seen.look);
    d_b = exp_so3(Vector3<double>(-(root * z))) * seen.d_b;
  }

  // J: of the residual by d_b.
  void add(const Matrix<double, 2, 3>& J, Matrix2<double>* covariance,
           Matrix<double, 2, 3>* J_look) const {
    const Matrix2<double> J_own = J * tangent_basis(d_b);
    *covariance += J_own * sight.covariance * J_own.transpose();
    *J_look += J * skew(d_b) * root;
  }
};

// Residual of a direction `to` that the plane predicts, with its Jacobian, against the sight.
// Returns the derivative by the sight's direction.
Matrix<double, 2, 3> compare(const Vector3<double>& to, const PlaneRow3& J_to_plane,
                             const TrueSight& sight, DatumResidual* out,
                             Matrix<double, 2, 3>* J_r_to = nullptr) {
  Matrix<double, 2, 3> J_to;
  Matrix<double, 2, 3> J_from;
  out->r = direction_minus(to, sight.d_b, &J_to, &J_from);
  out->J_plane = J_to * J_to_plane;
  if (J_r_to != nullptr) *J_r_to = J_to;
  return J_from;
}

// Of R_base_from_world v.
PlaneRow3 rotated_jacobian(const WorldPlane& plane, const Vector3<double>& v_w) {
  PlaneRow3 J = PlaneRow3::Zero();
  J.leftCols<3>() = -plane.R_base_from_world * skew(v_w);
  return J;
}

bool point_residual(const PlaneDatum& datum, const TrueSight& sight, const WorldPlane& plane,
                    DatumResidual* out) {
  Vector3<double> d;
  Matrix3<double> J_d_P;
  PlaneRow3 J_d_plane;
  if (direction_of(plane, datum.place, &d, &J_d_P, &J_d_plane) != PlaneStatus::kOk) return false;
  Matrix<double, 2, 3> J_r_to;
  const Matrix<double, 2, 3> J_sight = compare(d, J_d_plane, sight, out, &J_r_to);
  const Matrix<double, 2, 3> J_place = J_r_to * J_d_P;
  out->covariance = J_place * datum.place_sigma.cwiseAbs2().asDiagonal() * J_place.transpose();
  sight.add(J_sight, &out->covariance, &out->J_sight_look);
  return true;
}

bool horizon_residual(const TrueSight& sight, const WorldPlane& plane, DatumResidual* out) {
  const Vector3<double> d_w = plane.R_base_from_world.transpose() * sight.d_b;
  const double level = d_w.head<2>().norm();
  if (!(level > 1e-6)) return false;
  out->size = 1;
  out->r[0] = std::atan2(d_w.z(), level);
  Matrix<double, 2, 3> J_dw = Matrix<double, 2, 3>::Zero();
  J_dw.row(0) << -d_w.z() * d_w.head<2>().transpose() / level, level;
  out->J_plane.leftCols<3>() = J_dw * skew(d_w);
  out->covariance = Vector2<double>(0, 1).asDiagonal();
  sight.add(J_dw * plane.R_base_from_world.transpose(), &out->covariance, &out->J_sight_look);
  return true;
}

void vertical_residual(const TrueSight& sight, const WorldPlane& plane, DatumResidual* out) {
  // Up or down, whichever is nearer.
  const Vector3<double> up_w =
      Vector3<double>::UnitZ() * (plane.up_b().dot(sight.d_b) < 0 ? -1 : 1);
  const Matrix<double, 2, 3> J_sight =
      compare(plane.R_base_from_world * up_w, rotated_jacobian(plane, up_w), sight, out);
  out->covariance.setZero();
  sight.add(J_sight, &out->covariance, &out->J_sight_look);
}

void bearing_residual(const PlaneDatum& datum, const TrueSight& sight, const WorldPlane& plane,
                      DatumResidual* out) {
  const Vector3<double> d_w(std::sin(datum.value), std::cos(datum.value), 0);
  const Vector3<double> J_dw_heading(d_w.y(), -d_w.x(), 0);
  Matrix<double, 2, 3> J_r_to;
  const Matrix<double, 2, 3> J_sight =
      compare(plane.R_base_from_world * d_w, rotated_jacobian(plane, d_w), sight, out, &J_r_to);
  const Vector2<double> J_heading = J_r_to * (plane.R_base_from_world * J_dw_heading);
  out->covariance = datum.sigma * datum.sigma * J_heading * J_heading.transpose();
  sight.add(J_sight, &out->covariance, &out->J_sight_look);
}

// The place on the plane that a sight shows.
struct SightedPlace {
  Vector2<double> X;
  Matrix<double, 2, 3> J_X_d;
  Matrix<double, 2, kPlaneParameterCount> J_X_plane;

  [[nodiscard]] bool find(const WorldPlane& plane, const TrueSight& sight) {
    return plane_point(plane, sight.d_b, &X, &J_X_d, &J_X_plane) == PlaneStatus::kOk;
  }
};

bool length_residual(const PlaneDatum& datum, const TrueSight& from, const TrueSight& to,
                     const WorldPlane& plane, DatumResidual* out) {
  SightedPlace a;
  SightedPlace b;
  if (!a.find(plane, from) || !b.find(plane, to)) return false;
  const Vector2<double> between = b.X - a.X;
  const double length = between.norm();
  if (!(length > 0)) return false;
  out->size = 1;
  out->r[0] = length - datum.value;
  Matrix2<double> along = Matrix2<double>::Zero();
  along.row(0) = between.transpose() / length;
  out->J_plane = along * (b.J_X_plane - a.J_X_plane);
  out->covariance = Vector2<double>(datum.sigma * datum.sigma, 1).asDiagonal();
  from.add(-along * a.J_X_d, &out->covariance, &out->J_sight_look);
  to.add(along * b.J_X_d, &out->covariance, &out->J_other_look);
  return true;
}

bool upright_residual(const PlaneDatum& datum, const TrueSight& foot, const TrueSight& head,
                      const WorldPlane& plane, DatumResidual* out) {
  SightedPlace stands;
  if (!stands.find(plane, foot)) return false;
  const Vector3<double> top(stands.X.x(), stands.X.y(), datum.value);
  Vector3<double> d;
  Matrix3<double> J_d_P;
  PlaneRow3 J_d_plane;
  if (direction_of(plane, top, &d, &J_d_P, &J_d_plane) != PlaneStatus::kOk) return false;
  Matrix<double, 2, 3> J_r_to;
  const PlaneRow3 J_with_foot = J_d_plane + J_d_P.leftCols<2>() * stands.J_X_plane;
  const Matrix<double, 2, 3> J_head = compare(d, J_with_foot, head, out, &J_r_to);
  const Vector2<double> J_height = J_r_to * J_d_P.col(2);
  out->covariance = datum.sigma * datum.sigma * J_height * J_height.transpose();
  foot.add(J_r_to * J_d_P.leftCols<2>() * stands.J_X_d, &out->covariance, &out->J_sight_look);
  head.add(J_head, &out->covariance, &out->J_other_look);
  return true;
}

}  // namespace

bool datum_residual(const PlaneDatum& datum, const std::vector<Matrix3<double>>& roots,
                    const PlaneState& state, DatumResidual* out) {
  *out = DatumResidual();
  const WorldPlane& plane = state.plane;
  const double variance = datum.sigma * datum.sigma;
  const TrueSight sight(datum.sight, roots, state);
  switch (datum.kind) {
    case PlaneDatumKind::kHeight:
      out->size = 1;
      out->r[0] = plane.position.z() - datum.value;
      out->J_plane(0, 5) = 1;
      out->covariance(0, 0) = variance;
      return true;
    case PlaneDatumKind::kPlace:
      out->r = (plane.position - datum.place).head<2>();
      out->J_plane.middleCols<2>(3).setIdentity();
      out->covariance = datum.place_sigma.head<2>().cwiseAbs2().asDiagonal();
      return true;
    case PlaneDatumKind::kHeading:
      out->size = 1;
      out->r[0] = wrap_angle(heading(plane) - datum.value);
      out->J_plane.row(0).head<3>() = heading_jacobian(plane).transpose();
      out->covariance(0, 0) = variance;
      return !out->J_plane.isZero(0);
    case PlaneDatumKind::kLevel: {
      Matrix<double, 2, 3> J_up;
      out->r = direction_minus(plane.up_b(), datum.place, &J_up);
      out->J_plane = J_up * rotated_jacobian(plane, Vector3<double>::UnitZ());
      out->covariance *= variance;
      return true;
    }
    case PlaneDatumKind::kPoint:
      return point_residual(datum, sight, plane, out);
    case PlaneDatumKind::kHorizon:
      return horizon_residual(sight, plane, out);
    case PlaneDatumKind::kBearing:
      bearing_residual(datum, sight, plane, out);
      return true;
    case PlaneDatumKind::kVertical:
      vertical_residual(sight, plane, out);
      return true;
    case PlaneDatumKind::kLength:
      return length_residual(datum, sight, TrueSight(datum.other, roots, state), plane, out);
    case PlaneDatumKind::kUpright:
      return upright_residual(datum, sight, TrueSight(datum.other, roots, state), plane, out);
  }
  return false;
}

}  // namespace internal
}  // namespace alidade

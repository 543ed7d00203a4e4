#include "core/mapping/landmark_filter.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/mapping/map_projection.h"
#include "core/model/direction.h"

namespace alidade {

ProjectionStatus see_landmark(const PosedPicture& picture, const Vector2<double>& u,
                              double sigma_px, const Vector3<double>& d_b, LandmarkSight* out) {
  MapProjection p;
  const ProjectionStatus status =
      project_from_map(picture.camera, picture.motion, picture.R_base_from_camera, u.y(), d_b, &p);
  if (status != ProjectionStatus::kOk) return status;
  const Matrix2<double> J_u_tangent = p.J_u_d * tangent_basis(d_b);
  const double determinant = J_u_tangent.determinant();
  if (!std::isnormal(determinant)) return ProjectionStatus::kBeyondDistortionLimit;
  const Matrix2<double> G = J_u_tangent.inverse();
  out->y = G * (u - p.u);
  // An error of the row moves the time at which the landmark is projected.
  Matrix2<double> J_r_u = Matrix2<double>::Identity();
  J_r_u.col(1) -= p.J_u_row;
  out->J_y_u = G * J_r_u;
  out->J_y_pose << -G * p.J_u_xi, -G * (p.J_u_camera * picture.J_camera_log);
  out->cov_detection = sigma_px * sigma_px * out->J_y_u * out->J_y_u.transpose();
  out->cov_of_pose = out->J_y_pose * picture.cov_pose * out->J_y_pose.transpose();
  return ProjectionStatus::kOk;
}

Matrix2<double> innovation_covariance(const LandmarkSight& sight,
                                      const Matrix2<double>& covariance) {
  return sight.cov_of_pose + sight.cov_detection + covariance;
}

Matrix2<double> root_of(const Matrix2<double>& m) {
  const double s = std::sqrt(std::max(0.0, m.determinant()));
  const double t = std::sqrt(std::max(0.0, m.trace() + 2 * s));
  if (t == 0) return Matrix2<double>::Zero();
  return (m + s * Matrix2<double>::Identity()) / t;
}

LandmarkUpdate update_landmark(const LandmarkSight& sight, const Matrix2<double>& common,
                               double share_of_landmarks, double news, double gate_sigmas,
                               LandmarkState* state) {
  const Matrix2<double> cov_y = innovation_covariance(sight, state->covariance);
  if (!std::isnormal(cov_y.determinant())) return LandmarkUpdate::kSingular;
  if (!(sight.y.dot(cov_y.inverse() * sight.y) <= gate_sigmas * gate_sigmas)) {
    return LandmarkUpdate::kBeyondGate;
  }
  const Matrix2<double> of_picture = (sight.cov_detection + sight.cov_of_pose) / news;
  const Matrix2<double> K = state->covariance * (of_picture + state->covariance).inverse();
  const Matrix2<double> rest = Matrix2<double>::Identity() - K;
  // Joseph form: stays positive under rounding.
  const Matrix2<double> own =
      rest * state->covariance * rest.transpose() + K * of_picture * K.transpose();
  const bool is_known_better = common.trace() <= state->shared_covariance.trace();
  const Matrix2<double> root = root_of(state->shared_covariance);
  const Matrix2<double> M =
      is_known_better ? root : Matrix2<double>(rest * root + K * root_of(common));
  const Matrix2<double> shared =
      M * M.transpose() + K.trace() / 2 * share_of_landmarks * sight.cov_of_pose;
  // The covariances are turned into the new basis, which may have jumped.
  const Matrix<double, 3, 2> before = tangent_basis(state->d_b);
  state->d_b = direction_plus<double>(state->d_b, K * sight.y).normalized();
  const Matrix2<double> turn = tangent_basis(state->d_b).transpose() * before;
  state->covariance = turn * symmetric(own) * turn.transpose();
  state->shared_covariance = turn * symmetric(shared) * turn.transpose();
  return LandmarkUpdate::kOk;
}

}  // namespace alidade

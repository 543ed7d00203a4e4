#include "core/mapping/map_projection.h"

#include "core/model/lens/zoom_law.h"
#include "core/model/rotation.h"

namespace alidade {

ProjectionStatus project_from_map(const Camera<double>& camera, const PictureMotion& motion,
                                  const Matrix3<double>& R_base_from_camera, double row,
                                  const Vector3<double>& d_b, MapProjection* out) {
  const double time = motion.time_of_row(row);
  const Vector3<double> d_reference = R_base_from_camera.transpose() * d_b;
  const bool turns = time != 0 && !motion.angular_velocity.isZero(0);
  const Vector3<double> turn = -time * motion.angular_velocity;
  const Matrix3<double> R_row_from_reference =
      turns ? exp_so3(turn) : Matrix3<double>(Matrix3<double>::Identity());
  const Vector3<double> d_row = R_row_from_reference * d_reference;
  const bool zooms = motion.zoom_rate != 0;
  const Camera<double> at_row = zooms ? zoomed(camera, motion.zoom_rate * time) : camera;
  Matrix<double, 2, 3> J_u_row_frame;
  const ProjectionStatus status = project(at_row, d_row, &out->u, &J_u_row_frame, &out->J_u_camera);
  if (status != ProjectionStatus::kOk) return status;
  const Matrix<double, 2, 3> J_u_turned = J_u_row_frame * skew(d_row);
  const Vector2<double> J_u_log_f = by_zoom(at_row, out->J_u_camera);
  const Vector2<double> J_u_time =
      J_u_turned * motion.angular_velocity + motion.zoom_rate * J_u_log_f;
  out->J_u_motion << time * J_u_turned, time * J_u_log_f;
  if (turns) out->J_u_motion.leftCols<3>() *= left_jacobian_so3(turn);
  if (zooms) {
    refer_to_unzoomed(at_row.focal_length / camera.focal_length, &out->J_u_camera);
  }
  out->J_u_row = motion.line_delay * J_u_time;
  const Matrix<double, 2, 3> J_u_reference = J_u_row_frame * R_row_from_reference;
  out->J_u_xi = J_u_reference * skew(d_reference);
  out->J_u_d = J_u_reference * R_base_from_camera.transpose();
  return ProjectionStatus::kOk;
}

ProjectionStatus pixel_from_map(const Camera<double>& camera, const PictureMotion& motion,
                                const Matrix3<double>& R_base_from_camera, double row,
                                const Vector3<double>& d_b, Vector2<double>* u) {
  const double time = motion.time_of_row(row);
  Vector3<double> d_row = R_base_from_camera.transpose() * d_b;
  if (time != 0 && !motion.angular_velocity.isZero(0)) {
    d_row = exp_so3(Vector3<double>(-time * motion.angular_velocity)) * d_row;
  }
  const double change = motion.zoom_rate * time;
  return change != 0 ? project(zoomed(camera, change), d_row, u) : project(camera, d_row, u);
}

ProjectionStatus unproject_to_map(const Camera<double>& camera, const PictureMotion& motion,
                                  const Matrix3<double>& R_base_from_camera,
                                  const Vector2<double>& u, Vector3<double>* d_b) {
  const double time = motion.time_of_row(u.y());
  Vector3<double> d_row;
  const ProjectionStatus status = unproject(zoomed(camera, motion.zoom_rate * time), u, &d_row);
  if (status != ProjectionStatus::kOk) return status;
  *d_b = R_base_from_camera * (exp_so3(Vector3<double>(time * motion.angular_velocity)) * d_row);
  return ProjectionStatus::kOk;
}

}  // namespace alidade

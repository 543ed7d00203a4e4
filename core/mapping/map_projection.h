#pragma once
// Where one picture sees a direction of the map, for localization and adjustment. No allocation.
//   u = project(camera at row v, M(v)^T R^T d),   R = R_base_from_camera at the reference row
//   M(v) = Exp(w t), t = (v - reference row) * line delay;   log f at row v grows by zoom_rate t
// f changes by zoom_law.h. w is the camera's turn rate in its own frame,
// constant over a picture (constant rates of the angles, as in rolling_shutter.h, differ in second
// order). v is the measured row; its error moves t: see reprojection_error_covariance() there. A
// picture shows only rates times line delay: in_heights() gives the motion per image height.

#include "core/model/lens/camera.h"
#include "core/model/lens/zoom_law.h"
#include "core/model/rolling_shutter.h"
#include "core/model/rotation.h"

namespace alidade {

struct PictureMotion {
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // w, camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  double line_delay = 0;                                       // s/row, any sign
  double reference_row = 0;                                    // px

  [[nodiscard]] double time_of_row(double v) const { return (v - reference_row) * line_delay; }
};

// The same with the time of one image height as the unit. A line delay of 0 gives rates of 0.
[[nodiscard]] inline PictureMotion in_heights(const PictureMotion& motion, int height) {
  const double read_out = motion.line_delay * height;
  return {motion.angular_velocity * read_out, motion.zoom_rate * read_out, 1.0 / height,
          motion.reference_row};
}

struct MapProjection {
  Vector2<double> u;                                    // px
  Vector2<double> J_u_row;                              // motion of the image per row
  Matrix<double, 2, 3> J_u_xi;                          // by xi of R Exp(xi)
  Matrix<double, 2, 3> J_u_d;                           // by d in base
  Matrix<double, 2, kCameraParameterCount> J_u_camera;  // by the camera at the reference row
  Matrix<double, 2, 4> J_u_motion;                      // by w and zoom rate
};

[[nodiscard]] inline ProjectionStatus project_from_map(const Camera<double>& camera,
                                                       const PictureMotion& motion,
                                                       const Matrix3<double>& R_base_from_camera,
                                                       double row, const Vector3<double>& d_b,
                                                       MapProjection* out) {
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

// The pixel only.
[[nodiscard]] inline ProjectionStatus pixel_from_map(const Camera<double>& camera,
                                                     const PictureMotion& motion,
                                                     const Matrix3<double>& R_base_from_camera,
                                                     double row, const Vector3<double>& d_b,
                                                     Vector2<double>* u) {
  const double time = motion.time_of_row(row);
  Vector3<double> d_row = R_base_from_camera.transpose() * d_b;
  if (time != 0 && !motion.angular_velocity.isZero(0)) {
    d_row = exp_so3(Vector3<double>(-time * motion.angular_velocity)) * d_row;
  }
  const double change = motion.zoom_rate * time;
  return change != 0 ? project(zoomed(camera, change), d_row, u) : project(camera, d_row, u);
}

// The direction that a pixel shows, unit length, base.
[[nodiscard]] inline ProjectionStatus unproject_to_map(const Camera<double>& camera,
                                                       const PictureMotion& motion,
                                                       const Matrix3<double>& R_base_from_camera,
                                                       const Vector2<double>& u,
                                                       Vector3<double>* d_b) {
  const double time = motion.time_of_row(u.y());
  Vector3<double> d_row;
  const ProjectionStatus status = unproject(zoomed(camera, motion.zoom_rate * time), u, &d_row);
  if (status != ProjectionStatus::kOk) return status;
  *d_b = R_base_from_camera * (exp_so3(Vector3<double>(time * motion.angular_velocity)) * d_row);
  return ProjectionStatus::kOk;
}

}  // namespace alidade

#pragma once
// Where one picture sees a direction of the map, for localization and adjustment. No allocation.
//   u = project(camera at row v, M(v)^T R^T d),   R = R_base_from_camera at the reference row
//   M(v) = Exp(w t), t = (v - reference row) * line delay;   log f at row v grows by zoom_rate t
// When f changes, distortion and centre follow zoom_law.h. w is the camera's turn rate in its own
// frame, constant over a picture (constant rates of the angles, as in rolling_shutter.h, differ in
// second order). v is the measured row; its error moves t: see reprojection_error_covariance() in
// rolling_shutter.h.

#include "core/mapping/picture_motion.h"
#include "core/model/lens/camera.h"

namespace alidade {

struct MapProjection {
  Vector2<double> u;                                    // px
  Vector2<double> J_u_row;                              // px per row, by v
  Matrix<double, 2, 3> J_u_xi;                          // px/rad, by xi of R Exp(xi)
  Matrix<double, 2, 3> J_u_d;                           // by d in base
  Matrix<double, 2, kCameraParameterCount> J_u_camera;  // by the camera at the reference row
  Matrix<double, 2, 4> J_u_motion;                      // px s, by w and zoom rate
};

// camera: at the reference row. row: v, px. *out is written with kOk only, here and below.
[[nodiscard]] ProjectionStatus project_from_map(const Camera<double>& camera,
                                                const PictureMotion& motion,
                                                const Matrix3<double>& R_base_from_camera,
                                                double row, const Vector3<double>& d_b,
                                                MapProjection* out);

// The pixel only.
[[nodiscard]] ProjectionStatus pixel_from_map(const Camera<double>& camera,
                                              const PictureMotion& motion,
                                              const Matrix3<double>& R_base_from_camera, double row,
                                              const Vector3<double>& d_b, Vector2<double>* u);

// The direction that a pixel shows, unit length, base.
[[nodiscard]] ProjectionStatus unproject_to_map(const Camera<double>& camera,
                                                const PictureMotion& motion,
                                                const Matrix3<double>& R_base_from_camera,
                                                const Vector2<double>& u, Vector3<double>* d_b);

}  // namespace alidade

#pragma once
// The plane as in Lisanti et al. (eqs. 10 to 13), for a camera without distortion whose rows are
// exposed at once:
//   image from plane   G^-1 ~ K R_camera_from_base R_base_from_world [e_x, e_y, -p]
//   plane from image   G = H_W H_rk H^-1      (10); H_rk H^-1: image to mosaic, K_m R K^-1
//   plane from mosaic  H_W = H_s H_p           (11); from two vanishing points and two known points
//   head from foot     W = I + (mu - 1) v l^T / (v . l)                         (13), h ~ W p (12)
// Tests compare them with world_plane.h, which the program uses. Homographies are up to scale. No
// allocation. Notation: docs/derivations.md.

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/ground/world_plane.h"
#include "core/model/lens/camera.h"

namespace alidade {

// K of a camera without distortion.
[[nodiscard]] inline Matrix3<double> camera_matrix(const Camera<double>& camera) {
  const Vector2<double> centre = camera.optical_centre();
  Matrix3<double> K;
  K << camera.focal_length, 0, centre.x(),                 //
      0, camera.focal_length * camera.aspect, centre.y(),  //
      0, 0, 1;
  return K;
}

// Between two images from one optical centre: H_infinity.
[[nodiscard]] inline Matrix3<double> image_from_image(const Matrix3<double>& K_to,
                                                      const Matrix3<double>& R_to_from,
                                                      const Matrix3<double>& K_from) {
  return K_to * R_to_from * K_from.inverse();
}

[[nodiscard]] inline Matrix3<double> image_from_plane(const Matrix3<double>& K,
                                                      const Matrix3<double>& R_camera_from_base,
                                                      const WorldPlane& plane) {
  Matrix3<double> columns;
  columns << Matrix<double, 3, 2>::Identity(), -plane.position;
  return K * R_camera_from_base * plane.R_base_from_world * columns;
}

// H_p, from the vanishing points (px, homogeneous) of two perpendicular directions of the plane.
// The directions become x and y of the rectified image, so that x, y, up are right-handed. False if
// the two coincide.
[[nodiscard]] inline bool rectifying_homography(const Matrix3<double>& K,
                                                const Vector3<double>& vanishing_x,
                                                const Vector3<double>& vanishing_y,
                                                Matrix3<double>* H_p) {
  const Matrix3<double> K_inverse = K.inverse();
  const Vector3<double> x = (K_inverse * vanishing_x).normalized();
  Vector3<double> up = x.cross(K_inverse * vanishing_y);
  if (!(up.norm() > 1e-12)) return false;
  up.normalize();
  Matrix3<double> R_camera_from_plane;
  R_camera_from_plane << x, up.cross(x), up;
  *H_p = R_camera_from_plane.transpose() * K_inverse;
  return true;
}

// H_s: the similarity that takes two points of the rectified image to their places on the plane, m.
// |to_b - to_a| is the known length. False if the two points of a pair coincide.
[[nodiscard]] inline bool similarity(const Vector2<double>& from_a, const Vector2<double>& from_b,
                                     const Vector2<double>& to_a, const Vector2<double>& to_b,
                                     Matrix3<double>* H_s) {
  const Vector2<double> from = from_b - from_a;
  const Vector2<double> to = to_b - to_a;
  if (!(from.squaredNorm() > 0) || !(to.squaredNorm() > 0)) return false;
  // Rotation and scale are to / from as complex numbers.
  const double real = from.dot(to) / from.squaredNorm();
  const double imaginary = (from.x() * to.y() - from.y() * to.x()) / from.squaredNorm();
  Matrix2<double> turn;
  turn << real, -imaginary, imaginary, real;
  H_s->setIdentity();
  H_s->topLeftCorner<2, 2>() = turn;
  H_s->topRightCorner<2, 1>() = to_a - turn * from_a;
  return true;
}

// The image of the horizon, a line. G: plane from image.
[[nodiscard]] inline Vector3<double> vanishing_line(const Matrix3<double>& G) {
  return G.row(2).transpose();
}

[[nodiscard]] inline Vector3<double> vanishing_point_of_normal(const Matrix3<double>& K,
                                                               const Vector3<double>& line) {
  return K * (K.transpose() * line);
}

// mu. camera_height_m: not 0.
[[nodiscard]] inline double target_cross_ratio(double target_height_m, double camera_height_m) {
  return 1 - target_height_m / camera_height_m;
}

// W.
[[nodiscard]] inline Matrix3<double> target_homology(const Matrix3<double>& K,
                                                     const Matrix3<double>& G, double mu) {
  const Vector3<double> line = vanishing_line(G);
  const Vector3<double> point = vanishing_point_of_normal(K, line);
  return Matrix3<double>::Identity() + (mu - 1) / point.dot(line) * point * line.transpose();
}

}  // namespace alidade

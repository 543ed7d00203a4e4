#pragma once
// The entrance pupil: where rays seem to enter the lens. Directions are seen from there, and the
// base's origin is where pan and tilt axis meet. o is the pupil's place from the origin, in camera
// axes (right, down, forward; m). A thing at the distance r from the origin lies in the direction d
// and is seen in the direction d_seen:
//   r d = R_base_from_camera o + t d_seen,   t > 0
// The two directions of a far thing are the same. Pure; no allocation.

#include <cmath>
#include <limits>

#include "core/model/direction.h"
#include "core/model/linear_algebra.h"

namespace alidade {

// Usual lenses on usual heads: one standard deviation along each axis.
inline constexpr double kUsualPupilSigma_m = 0.05;
// The same for a place that somebody measured.
inline constexpr double kStatedPupilSigma_m = 0.005;

struct Pupil {
  Vector3<double> place_m = Vector3<double>::Zero();
  Vector3<double> sigma_m = Vector3<double>::Constant(kUsualPupilSigma_m);  // of each component
};

// Largest accepted coordinate of a pupil's place, and smallest accepted distance of a scene. Input
// beyond them is refused where it is read, as it is probably in another unit.
inline constexpr double kFarthestPupil_m = 1;
inline constexpr double kNearestScene_m = 1;

// Distances of what is in view, from where pan and tilt axis meet. farthest_m >= nearest_m > 0.
struct SceneDistance {
  double nearest_m = kNearestScene_m;
  double farthest_m = std::numeric_limits<double>::infinity();
};

// z / r: z the pupil's place in front of the axes (m, Pupil::place_m.z()), r the thing's distance
// (m). Things at the distance r look like far things through a lens whose log f is larger by this.
struct Nearness {
  double value = 0;
  double sigma = 0;
};

// Nearness of what is in view, on average. The mean of its inverse distances may be anywhere
// between those of the scene's ends.
[[nodiscard]] inline Nearness scene_nearness(const Pupil& pupil, const SceneDistance& scene) {
  const double near = 1 / scene.nearest_m;
  const double far = 1 / scene.farthest_m;
  const double mean = (near + far) / 2;
  const double variance = (near - far) * (near - far) / 12;
  const double o = pupil.place_m.z();
  const double of_pupil = pupil.sigma_m.z() * pupil.sigma_m.z();
  return {mean * o, std::sqrt(of_pupil * (mean * mean + variance) + variance * o * o)};
}

// A calibration made of a scene with this nearness (scene_nearness()) takes a thing for a far one
// in d. Returns the direction in which the pupil truly sees it. Unit vectors, base.
[[nodiscard]] inline Vector3<double> seen_by_pupil(const Matrix3<double>& R_base_from_camera,
                                                   const Vector3<double>& d, double nearness) {
  Vector3<double> d_c = R_base_from_camera.transpose() * d;
  d_c.z() *= std::exp(-nearness);
  return (R_base_from_camera * d_c).normalized();
}

// *d: direction from the axes of a thing at distance_m from them that the pupil sees in d_seen
// (unit vectors, base). *cov: rad^2, in tangent_basis(*d), from the errors of the pupil's place and
// of the distance only. False if the pupil is not nearer to the axes than the thing; *d and *cov
// are then unchanged.
[[nodiscard]] inline bool direction_from_axes(const Pupil& pupil,
                                              const Matrix3<double>& R_base_from_camera,
                                              const Vector3<double>& d_seen, double distance_m,
                                              double distance_sigma_m, Vector3<double>* d,
                                              Matrix2<double>* cov) {
  const Vector3<double> o = R_base_from_camera * pupil.place_m;
  const double along = o.dot(d_seen);
  const double square = along * along + distance_m * distance_m - o.squaredNorm();
  if (!(o.norm() < distance_m) || !(square > 0)) return false;
  *d = ((o + (std::sqrt(square) - along) * d_seen) / distance_m).normalized();
  const Matrix<double, 2, 3> across = tangent_basis(*d).transpose();
  const Matrix<double, 2, 3> by_place = across * R_base_from_camera / distance_m;
  const Vector2<double> by_distance = across * (-o / (distance_m * distance_m));
  *cov = by_place * pupil.sigma_m.cwiseAbs2().asDiagonal() * by_place.transpose() +
         distance_sigma_m * distance_sigma_m * by_distance * by_distance.transpose();
  return true;
}

// The distance (m) from which a focal length of far things holds. Nearer things look as through a
// focal length that differs by a share of more than relative_sigma, if the pupil is one standard
// deviation farther from the axes than its place. 0 (no limit) if relative_sigma is not positive.
[[nodiscard]] inline double holds_beyond_m(const Pupil& pupil, double relative_sigma) {
  const double forward = std::abs(pupil.place_m.z()) + pupil.sigma_m.z();
  return relative_sigma > 0 ? forward / relative_sigma : 0;
}

}  // namespace alidade

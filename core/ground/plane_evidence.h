#pragma once
// What is known of the ground under a camera, for fit_plane() (plane_fit.h): any mix of data, each
// with its errors. Directions are in the base frame, of unit length. Errors of different data are
// independent, with one exception: sights from one picture share the error of its orientation, a
// turn that is called the look. All sigmas, heights and lengths are > 0; exact values get a small
// sigma. m and rad. Allocates (names).

#include <string>
#include <utility>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

// A direction that was seen: the true direction, turned by the look's error and by its own error.
struct PlaneSight {
  Vector3<double> d_b = Vector3<double>::UnitX();
  Matrix2<double> covariance = Matrix2<double>::Identity();  // own, rad^2, in tangent_basis(d_b)
  int look = -1;  // index of PlaneEvidence::looks; -1: none
};

// kHeight, kPlace, kLevel, kHeading: of the camera or its base.
// kPoint: direction to something with a known place in w, on the plane or above it.
// kHorizon: a direction with elevation 0: of the horizon, or the vanishing point of a line on the
// plane.
// kBearing: as kHorizon, with a known heading, as of a street in a map.
// kVertical: direction to the vanishing point of upright edges: straight up or straight down.
// kLength: directions to two points of the plane at a known distance.
// kUpright: directions to foot and head of something of known height that stands on the plane.
enum class PlaneDatumKind {
  kHeight,
  kPlace,
  kLevel,
  kHeading,
  kPoint,
  kHorizon,
  kBearing,
  kVertical,
  kLength,
  kUpright
};

[[nodiscard]] const char* to_string(PlaneDatumKind kind);

// Use the functions below to make one.
struct PlaneDatum {
  PlaneDatumKind kind = PlaneDatumKind::kHeight;
  std::string name;
  PlaneSight sight;  // of point, horizon, bearing, vertical; of the foot; of a length's beginning
  PlaneSight other;  // of the head; of a length's end
  Vector3<double> place = Vector3<double>::Zero();  // m, in w; kLevel: up, unit length, in base
  Vector3<double> place_sigma = Vector3<double>::Ones();  // m
  double value = 0;                                       // height, length: m; heading: rad
  double sigma = 1;                                       // of value
};

struct PlaneEvidence {
  std::vector<PlaneDatum> data;
  // Covariance of each look's turn about the base's axes, rad^2.
  std::vector<Matrix3<double>> looks;
  // Y of w is north, as places are on Earth: the data must determine the heading.
  bool y_is_north = false;
};

// Height of the camera above the plane, > 0.
[[nodiscard]] inline PlaneDatum camera_height(double height_m, double sigma_m) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kHeight;
  out.name = "height";
  out.value = height_m;
  out.sigma = sigma_m;
  return out;
}

// X and Y of the camera in w. sigma: of each.
[[nodiscard]] inline PlaneDatum camera_place(const Vector2<double>& place_m, double sigma_m) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kPlace;
  out.name = "place";
  out.place.head<2>() = place_m;
  out.place_sigma.setConstant(sigma_m);
  return out;
}

// Pitch and roll of the base against gravity, see R_base_from_world_of(). sigma: of each.
[[nodiscard]] PlaneDatum base_level(double pitch_rad, double roll_rad, double sigma_rad);

// Heading of the base's forward direction, clockwise from Y of w.
[[nodiscard]] inline PlaneDatum base_heading(double heading_rad, double sigma_rad) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kHeading;
  out.name = "heading";
  out.value = heading_rad;
  out.sigma = sigma_rad;
  return out;
}

// place_m: in w. sigma_m: of each component.
[[nodiscard]] inline PlaneDatum known_point(std::string name, const PlaneSight& sight,
                                            const Vector3<double>& place_m,
                                            const Vector3<double>& sigma_m) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kPoint;
  out.name = std::move(name);
  out.sight = sight;
  out.place = place_m;
  out.place_sigma = sigma_m;
  return out;
}

[[nodiscard]] inline PlaneDatum on_horizon(std::string name, const PlaneSight& sight) {
  PlaneDatum out;
  out.kind = PlaneDatumKind::kHorizon;
  out.name = std::move(name);
  out.sight = sight;
  return out;
}

// heading_rad: of the sight, clockwise from Y of w.
[[nodiscard]] inline PlaneDatum known_bearing(std::string name, const PlaneSight& sight,
                                              double heading_rad, double sigma_rad) {
  PlaneDatum out = on_horizon(std::move(name), sight);
  out.kind = PlaneDatumKind::kBearing;
  out.value = heading_rad;
  out.sigma = sigma_rad;
  return out;
}

[[nodiscard]] inline PlaneDatum vertical(std::string name, const PlaneSight& sight) {
  PlaneDatum out = on_horizon(std::move(name), sight);
  out.kind = PlaneDatumKind::kVertical;
  return out;
}

[[nodiscard]] inline PlaneDatum known_length(std::string name, const PlaneSight& from,
                                             const PlaneSight& to, double length_m,
                                             double sigma_m) {
  PlaneDatum out = on_horizon(std::move(name), from);
  out.kind = PlaneDatumKind::kLength;
  out.other = to;
  out.value = length_m;
  out.sigma = sigma_m;
  return out;
}

[[nodiscard]] inline PlaneDatum upright(std::string name, const PlaneSight& foot,
                                        const PlaneSight& head, double height_m, double sigma_m) {
  PlaneDatum out = known_length(std::move(name), foot, head, height_m, sigma_m);
  out.kind = PlaneDatumKind::kUpright;
  return out;
}

}  // namespace alidade

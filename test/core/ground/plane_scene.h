#pragma once
// What somebody can tell of the ground under a camera on a mast, with errors as stated: evidence for fit_plane() with a known truth.

#include <Eigen/Cholesky>
#include <random>
#include <string>

#include "core/ground/plane_evidence.h"
#include "core/ground/world_plane.h"
#include "core/model/direction.h"

namespace alidade::test {

class PlaneScene {
 public:
  WorldPlane truth;
  PlaneEvidence evidence;
  std::mt19937_64 random;
  double sight_sigma = 5e-4;  // rad

  explicit PlaneScene(std::uint64_t seed, double heading = 0.7) : random(seed) {
    truth.R_base_from_world = R_base_from_world_of(heading, 0.12, -0.05);
    truth.position = {35, -20, 12};
  }

  // As the camera defines w.
  static PlaneScene of_camera(std::uint64_t seed) {
    PlaneScene out(seed, 0);
    out.truth.position.head<2>().setZero();
    return out;
  }

  double noise(double sigma) { return sigma * normal_(random); }

  PlaneSight seen(const Vector3<double>& d_b, int look = -1) {
    PlaneSight sight;
    Vector3<double> d = d_b;
    if (look >= 0) {
      const Vector3<double> turn = look_turns_[static_cast<std::size_t>(look)];
      d = exp_so3(turn) * d;
    }
    sight.d_b = direction_plus(d, {noise(sight_sigma), noise(sight_sigma)});
    sight.covariance = sight_sigma * sight_sigma * Matrix2<double>::Identity();
    sight.look = look;
    return sight;
  }
  PlaneSight seen_place(const Vector3<double>& place, int look = -1) {
    Vector3<double> d;
    static_cast<void>(direction_of(truth, place, &d));
    return seen(d, look);
  }
  // Clockwise from Y, up: rad.
  PlaneSight seen_at(double azimuth, double elevation) {
    return seen(truth.R_base_from_world * Vector3<double>(std::sin(azimuth) * std::cos(elevation),
                                                          std::cos(azimuth) * std::cos(elevation),
                                                          std::sin(elevation)));
  }

  int add_look(const Vector3<double>& sigma) {
    const Vector3<double> turn(noise(sigma[0]), noise(sigma[1]), noise(sigma[2]));
    look_turns_.push_back(turn);
    evidence.looks.push_back(sigma.cwiseAbs2().asDiagonal());
    return static_cast<int>(look_turns_.size()) - 1;
  }
  void add(PlaneDatum datum) { evidence.data.push_back(std::move(datum)); }
  void add_height(double sigma = 0.05) { add(camera_height(truth.height() + noise(sigma), sigma)); }
  void add_level(double sigma = 2e-3) {
    PlaneDatum level = base_level(0, 0, sigma);
    level.place = direction_plus(truth.up_b(), {noise(sigma), noise(sigma)});
    add(level);
  }
  void add_heading(double sigma = 5e-3) { add(base_heading(heading(truth) + noise(sigma), sigma)); }
  void add_place(double sigma = 0.5) {
    add(camera_place(truth.position.head<2>() + Vector2<double>(noise(sigma), noise(sigma)),
                     sigma));
  }
  void add_point(const Vector3<double>& place, int look = -1) {
    const Vector3<double> sigma(0.03, 0.03, 0.02);
    const Vector3<double> stated =
        place + Vector3<double>(noise(sigma[0]), noise(sigma[1]), noise(sigma[2]));
    add(known_point("point " + std::to_string(evidence.data.size()), seen_place(place, look),
                    stated, sigma));
  }
  void add_horizon(double azimuth) {
    add(on_horizon("horizon " + std::to_string(evidence.data.size()), seen_at(azimuth, 0)));
  }
  void add_bearing(double azimuth, double sigma = 2e-3) {
    add(known_bearing("bearing " + std::to_string(evidence.data.size()), seen_at(azimuth, 0),
                      azimuth + noise(sigma), sigma));
  }
  void add_vertical() { add(vertical("plumb", seen_at(0, -kPi / 2))); }
  void add_length(const Vector2<double>& from, const Vector2<double>& to, double sigma = 0.05) {
    add(known_length("length " + std::to_string(evidence.data.size()),
                     seen_place({from.x(), from.y(), 0}), seen_place({to.x(), to.y(), 0}),
                     (to - from).norm() + noise(sigma), sigma));
  }
  void add_upright(const Vector2<double>& foot, double height = 1.8, double sigma = 0.02) {
    add(upright("upright " + std::to_string(evidence.data.size()),
                seen_place({foot.x(), foot.y(), 0}), seen_place({foot.x(), foot.y(), height}),
                height + noise(sigma), sigma));
  }

 private:
  std::normal_distribution<double> normal_;
  std::vector<Vector3<double>> look_turns_;
};

}  // namespace alidade::test

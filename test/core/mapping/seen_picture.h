#pragma once
// One picture of a turning, zooming camera, by a forward model of its own: mount and rates by Eigen's rotations, the lens the virtual
// camera's, the row found by iteration. No code of core/.

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "core/mapping/picture_pose.h"
#include "test/simulator/lens.h"
#include "test/support/hard_values.h"

namespace alidade::test {

struct SeenPicture {
  int width = 1280;
  int height = 720;
  double pan = 0, tilt = 0;            // rad, when the reference row is exposed
  double pan_rate = 0, tilt_rate = 0;  // rad/s
  double zoom_rate = 0;                // d log f / dt, 1/s
  double line_delay = 0;
  double reference_row = 0;
  double focal_length = 1500;
  double corner_distortion = 0;  // k (R / f)^2, R half the diagonal
  Eigen::Vector2d centre_offset{0, 0};
  Eigen::Vector3d pan_axis{0, 0, 1};
  Eigen::Vector3d tilt_axis{0, 1, 0};

  [[nodiscard]] Eigen::Matrix3d base_from_camera(double time) const {
    Eigen::Matrix3d base_from_rdf;
    base_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    return Eigen::AngleAxisd(pan + pan_rate * time, pan_axis).toRotationMatrix() *
           Eigen::AngleAxisd(tilt + tilt_rate * time, tilt_axis).toRotationMatrix() * base_from_rdf;
  }
  [[nodiscard]] simulator::Lens lens(double time) const {
    simulator::Lens out;
    out.focal_length = focal_length * std::exp(zoom_rate * time);
    const double per_corner = out.focal_length / (std::hypot(width, height) / 2);
    out.radial_distortion = corner_distortion * per_corner * per_corner;
    out.centre = Eigen::Vector2d(width, height) / 2 + centre_offset;
    return out;
  }
  [[nodiscard]] double time_of(double row) const { return (row - reference_row) * line_delay; }

  [[nodiscard]] std::optional<Eigen::Vector2d> seen(const Eigen::Vector3d& d_base) const {
    double row = height / 2.0;
    std::optional<Eigen::Vector2d> u;
    for (int step = 0; step < 60; ++step) {
      const double t = time_of(row);
      u = lens(t).project(base_from_camera(t).transpose() * d_base);
      if (!u) return std::nullopt;
      row = u->y();
    }
    return u;
  }
  [[nodiscard]] Eigen::Vector3d direction_of(const Eigen::Vector2d& u) const {
    const double t = time_of(u.y());
    const Eigen::Vector2d slope = lens(t).slope(u.x(), u.y());
    return (base_from_camera(t) * Eigen::Vector3d(slope.x(), slope.y(), 1)).normalized();
  }

  // What is told of it beforehand: all but angles and focal length.
  [[nodiscard]] PoseKnowledge knowledge(bool with_mount) const {
    PoseKnowledge out;
    const simulator::Lens at = lens(0);
    out.lens = LensCurve::of({at.focal_length,
                              1,
                              {at.radial_distortion},
                              width,
                              height,
                              centre_offset.x(),
                              centre_offset.y()});
    out.motion.line_delay = line_delay;
    out.motion.reference_row = reference_row;
    out.motion.zoom_rate = zoom_rate;
    // By the turn in 0.2 ms, at which a constant rate differs from the angles' by less than 1e-8 of it.
    constexpr double kStep_s = 1e-4;
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(base_from_camera(-kStep_s).transpose() * base_from_camera(kStep_s)));
    out.motion.angular_velocity = turn.angle() * turn.axis() / (2 * kStep_s);
    if (with_mount) {
      out.mechanics.emplace();
      out.mechanics->pan_axis = pan_axis;
      out.mechanics->tilt_axis = tilt_axis;
    }
    out.least_log_f = std::log(300.0);
    out.most_log_f = std::log(60000.0);
    return out;
  }
};

// Pictures that turn by up to `fields` of their field of view a second, with all the traits of a cheap camera.
inline SeenPicture lively_picture(double focal_length, double pan, double tilt, double fields) {
  SeenPicture out;
  out.pan = pan;
  out.tilt = tilt;
  out.focal_length = focal_length;
  out.pan_rate = fields * out.width / focal_length;
  out.tilt_rate = -0.4 * out.pan_rate;
  out.zoom_rate = 0.3 * fields;
  out.line_delay = -30e-6;
  out.reference_row = 360;
  out.corner_distortion = -0.03;
  out.centre_offset = {6, -4};
  out.pan_axis = paper_mechanics().pan_axis;
  out.tilt_axis = paper_mechanics().tilt_axis;
  return out;
}

// Matches of a picture, the right ones first.
struct SimulatedMatches {
  int right = 80;
  int wrong = 0;
  double sigma_px = 0.2;
  double claimed_px = 0.2;
  double landmark_sigma_px = 0.1;  // of the landmark's direction, at this picture's focal length
};
inline std::vector<PoseMatch> simulate(const SeenPicture& picture, const SimulatedMatches& what,
                                       std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  const auto anywhere = [&] {
    return Eigen::Vector2d(picture.width * part(*random), picture.height * part(*random));
  };
  const double sigma_d = what.landmark_sigma_px / picture.focal_length;
  std::vector<PoseMatch> out;
  while (static_cast<int>(out.size()) < what.right + what.wrong) {
    const bool is_right = static_cast<int>(out.size()) < what.right;
    const Eigen::Vector3d d = picture.direction_of(anywhere());
    const auto u = picture.seen(d);
    if (!u) continue;
    PoseMatch match;
    match.u = is_right ? Eigen::Vector2d(*u + what.sigma_px *
                                                  Eigen::Vector2d(normal(*random), normal(*random)))
                       : anywhere();
    match.sigma_px = what.claimed_px;
    const Eigen::Vector3d off =
        sigma_d * Eigen::Vector3d(normal(*random), normal(*random), normal(*random));
    match.d_b = (d + off - d * d.dot(off)).normalized();
    match.cov_d = sigma_d * sigma_d * Eigen::Matrix2d::Identity();
    out.push_back(match);
  }
  return out;
}

}  // namespace alidade::test

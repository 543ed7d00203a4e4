#pragma once
// A small adjustment whose data the state explains exactly: for derivatives, and to add noise to.

#include <array>
#include <cmath>
#include <cstddef>

#include "core/calibration/linearisation.h"
#include "core/model/rolling_shutter.h"

namespace alidade::test {

// A state, and data that it explains exactly: every observation is the solved rolling-shutter projection.
struct AdjustmentScene {
  ::alidade::internal::AdjustmentState state;
  ::alidade::internal::AdjustmentData data;
  ::alidade::internal::AdjustmentPriors priors;
  std::array<bool, ::alidade::internal::kGlobalCount> fixed{};
};

inline AdjustmentScene make_adjustment_scene(double readout_s = 0.02) {
  AdjustmentScene scene;
  ::alidade::internal::AdjustmentState& s = scene.state;
  s.camera = {3000, 1.02, {0}, 1920, 1080};
  s.corner_distortion[0] = 0.02;
  s.readout_s = readout_s;
  s.mechanics.pan_axis = Vector3<double>(0.03, -0.01, 1).normalized();
  s.mechanics.tilt_axis = Vector3<double>(-0.02, 1, 0.04).normalized();
  s.mechanics.pan_scale = 1.01;
  s.mechanics.tilt_scale = 0.98;
  s.shift_s = 0.03;
  s.drift = 1e-4;
  s.trajectory = TrajectorySpline({0, 0.5, 0.7, 1.2, 2});
  for (int i = 0; i < s.trajectory.control_points(); ++i) {
    s.trajectory.control_point(i) = {0.6 + 0.08 * std::sin(1.1 * i), 0.05 * std::cos(1.3 * i)};
  }
  s.anchor = {0.6, 0.0};
  const Matrix3<double> R_base_from_anchor = R_base_from_camera(s.mechanics, s.anchor);
  for (int i = 0; i < 40; ++i) {
    s.landmarks.push_back(
        Vector3<double>(0.3 * std::sin(2.1 * i), 0.2 * std::cos(1.7 * i), 1).normalized());
  }
  for (int f = 0; f < 12; ++f) scene.data.frame_time_s.push_back(0.1 + 0.15 * f);
  for (int l = 0; l < 40; ++l) {
    const Vector3<double> d_b = R_base_from_anchor * s.landmarks[static_cast<std::size_t>(l)];
    for (int f = 0; f < 12; ++f) {
      // The spline is no constant rate: expand about the row that is found, until it stays.
      const double t0 = scene.data.frame_time_s[static_cast<std::size_t>(f)];
      Vector2<double> u(960, 540);
      bool seen = true;
      for (int pass = 0; pass < 20 && seen; ++pass) {
        const double t = t0 + u.y() * s.line_delay();
        const FrameMotion<double> motion{s.trajectory.position(t), s.trajectory.rate(t), u.y()};
        seen = rolling_shutter_project(s.physical_camera(), s.mechanics, s.line_delay(), motion,
                                       d_b, &u) == ProjectionStatus::kOk;
      }
      if (!seen || u.x() < 0 || u.x() > 1920 || u.y() < 0 || u.y() > 1080) continue;
      scene.data.observations.push_back({l, f, u, 0.3, true});
    }
  }
  const Vector2<double> scale(s.mechanics.pan_scale, s.mechanics.tilt_scale);
  scene.data.reference_s = 1;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.04 + 0.032 * i;
    const double image_time = t - s.shift_s + s.drift * (t - scene.data.reference_s);
    scene.data.telemetry.push_back({t,
                                    scale.cwiseProduct(s.trajectory.position(image_time).vector()),
                                    Vector2<double>(1e-4, 2e-4)});
  }
  scene.priors.mean = s;
  scene.priors.information.setConstant(100);
  return scene;
}

}  // namespace alidade::test

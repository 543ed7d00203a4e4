#pragma once
// A small camera that pans before a far scene that is known everywhere: waves on the sphere. A disc moves in front of it, where asked for.

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "core/realtime/frame_orientation.h"
#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {

inline constexpr int kPanWidth = 256;      // px
inline constexpr int kPanHeight = 192;     // px
inline constexpr double kPanFocal = 4000;  // px
inline constexpr double kPanRate = 25;     // frames a second
inline constexpr double kPanNoise = 2;     // grey levels
inline constexpr double kPanMean = 120;    // grey level of the scene

// rad: where it is at time 0, and how fast.
struct Disc {
  Vector2<double> place{0, 0},
      velocity{0, 0};  // px at the focal length of kPanFocal; right, up; of time 0, a second
  double size_px = 8;
  double brighter = 30;  // grey levels
  bool even = false;     // of one grey level, else with the scene's waves
};

class PanningCamera {
 public:
  explicit PanningCamera(double fields_per_second = 0.5, double focal_length = kPanFocal)
      : pan_rate_(fields_per_second * kPanWidth / kPanFocal) {
    std::uniform_real_distribution<double> uniform(0, 1);
    for (Wave& wave : waves_) {
      const double number = 2 * kPi / (10 * std::pow(6, uniform(random_)));
      const double direction = 2 * kPi * uniform(random_);
      wave = {number * std::cos(direction), number * std::sin(direction),
              2 * kPi * uniform(random_)};
    }
    calibration.camera = {focal_length, 1, {30}, kPanWidth, kPanHeight};
    calibration.line_delay = -60e-6;
  }

  [[nodiscard]] FrameOrientation orientation(int frame) const {
    FrameMotion<double> motion;
    motion.angle = {pan_rate_ * frame / kPanRate, 0.01};
    motion.rate = {pan_rate_, 0.1 * pan_rate_};
    FrameOrientation out;
    EXPECT_TRUE(make_frame_orientation(calibration, frame / kPanRate, OrientationMode::kOe, 50,
                                       motion, MotionCovariance::Zero(), Sensitivity<6>::Zero(),
                                       &out));
    return out;
  }

  [[nodiscard]] Vector2<double> disc_pixel(const FrameOrientation& frame) const {
    Vector2<double> u(0, 0);
    for (int step = 0; step < 4; ++step) {
      const double time = frame.time_s + u.y() * calibration.line_delay;
      const Vector2<double> at = (disc->place + time * disc->velocity) / kPanFocal;
      const Vector3<double> d_b(std::cos(at.y()) * std::cos(at.x()),
                                std::cos(at.y()) * std::sin(at.x()), -std::sin(at.y()));
      EXPECT_EQ(frame.pixel(d_b, &u), ProjectionStatus::kOk);
    }
    return u;
  }

  // What it sees there: gain and offset are the light's.
  [[nodiscard]] Pixels image(const FrameOrientation& frame, double gain = 1, double offset = 0) {
    const Vector2<double> centre = disc ? disc_pixel(frame) : Vector2<double>(-1e3, -1e3);
    const auto grey = [&](const Vector2<double>& u) {
      Vector3<double> d;
      EXPECT_EQ(frame.direction(u, &d), ProjectionStatus::kOk);
      const double x = kPanFocal * std::atan2(d.y(), d.x());
      const double y = kPanFocal * std::asin(-d.z());
      double sum = kPanMean;
      for (const Wave& wave : waves_) sum += 9 * std::cos(wave.u * x + wave.v * y + wave.phase);
      if (disc) {
        const double inside = 0.5 * disc->size_px - (u - centre).norm() + 0.5;
        const double share = std::min(std::max(inside, 0.0), 1.0);
        sum += share * (disc->even ? kPanMean + disc->brighter - sum : disc->brighter);
      }
      const Vector2<double> middle(0.5 * kPanWidth, 0.5 * kPanHeight);
      const double darker = vignetting * (u - middle).squaredNorm() / middle.squaredNorm();
      return gain * (1 - darker) * sum + offset;
    };
    return make_pixels(kPanWidth, kPanHeight, grey, kPanNoise, &random_);
  }

  Calibration calibration;
  std::optional<Disc> disc;
  double vignetting = 0;  // share of the light that the corners lack

 private:
  struct Wave {
    double u, v, phase;
  };

  double pan_rate_;
  std::mt19937_64 random_{7};
  std::array<Wave, 8> waves_;
};

}  // namespace alidade::test

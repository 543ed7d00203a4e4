#pragma once
// A camera moved by hand before a board, with known truth. Shares no mathematics with core/pattern: the pose is sums of sines in
// position and Euler angles, rotations are products about axes, the lens is written out again, the row is found by secants.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"

namespace alidade::test {

struct SimulatedLens {
  double f_u = 600, f_v = 602, c_u = 380, c_v = 236;  // px
  double k1 = -0.28, k2 = 0.08, p1 = 3e-4, p2 = -2e-4;
  double line_delay_s = 51.56e-6;
};

inline LensVector truth_of(const SimulatedLens& l) {
  LensVector truth;
  truth << l.f_u, l.f_v, l.c_u, l.c_v, l.k1, l.k2, l.p1, l.p2, l.line_delay_s;
  return truth;
}

// How the board moves before the camera: of x, y, z (m) and of the turns about x, y, z (rad).
struct HandStyle {
  std::array<double, 6> amplitude = {{1, 1, 1, 1, 1, 1}};  // times the usual
  double away_m = 0.55;
  double tilt_rad = 0;  // about the board's y, as it lies before it moves
};

struct PatternScene {
  SimulatedLens lens;
  int width = 752, height = 480;  // px
  int columns = 9, rows = 6;
  double square_m = 0.03;
  bool staggered =
      false;  // an asymmetric grid of circles: square_m is half of the distance of two in a row
  double rate_hz = 20;
  double duration_s = 30;
  double noise_px = 0.05;
  double speed = 1;  // of the hand
  HandStyle hand;
  double wrong = 0;           // fraction of detections that are anywhere within 10 px
  double missing_frames = 0;  // fraction of frames without the board
  std::uint64_t seed = 1;
};

// Position (m, board's frame: x right, y down, z into the board) and orientation of the camera.
class HandMotion {
 public:
  HandMotion(std::uint64_t seed, double speed, const HandStyle& style)
      : away_m_(style.away_m), tilt_(Eigen::AngleAxisd(style.tilt_rad, Eigen::Vector3d::UnitY())) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    // Amplitudes of x, y, z (m) and of the turns about x, y, z (rad): slow and wide, medium, fast and small.
    const double amplitude[3][6] = {{.08, .06, .12, .35, .35, .25},
                                    {.03, .03, .03, .12, .12, .12},
                                    {.008, .008, .008, .03, .03, .03}};
    const double frequency[3] = {0.13, 0.5, 1.3};
    for (int band = 0; band < 3; ++band) {
      for (int i = 0; i < 6; ++i) {
        const double f = frequency[band] * (0.75 + 0.5 * uniform(random)) * speed;
        const double size = amplitude[band][i] * style.amplitude[static_cast<std::size_t>(i)];
        waves_[i][band] = {size * (0.7 + 0.6 * uniform(random)), 2 * M_PI * f,
                           2 * M_PI * uniform(random)};
      }
    }
  }

  // Of a point in the board's frame, in the camera's.
  [[nodiscard]] Eigen::Vector3d in_camera(const Eigen::Vector3d& p,
                                          const Eigen::Vector3d& board_centre, double t) const {
    double x[6];
    for (int i = 0; i < 6; ++i) {
      x[i] = 0;
      for (const Wave& wave : waves_[i])
        x[i] += wave.amplitude * std::sin(wave.frequency * t + wave.phase);
    }
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(x[5], Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(x[4], Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(x[3], Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
    // The board turns about its middle, which stays ahead.
    return tilt_ * (turn * (p - board_centre)) + Eigen::Vector3d(x[0], x[1], away_m_ + x[2]);
  }

 private:
  struct Wave {
    double amplitude, frequency, phase;
  };
  Wave waves_[6][3];
  double away_m_;
  Eigen::AngleAxisd tilt_;
};

inline Eigen::Vector2d simulated_pixel(const SimulatedLens& lens, const Eigen::Vector3d& p) {
  const double a = p.x() / p.z();
  const double b = p.y() / p.z();
  const double q = a * a + b * b;
  const double radial = 1 + lens.k1 * q + lens.k2 * q * q;
  const double a_d = a * radial + 2 * lens.p1 * a * b + lens.p2 * (q + 2 * a * a);
  const double b_d = b * radial + lens.p1 * (q + 2 * b * b) + 2 * lens.p2 * a * b;
  return {lens.f_u * a_d + lens.c_u, lens.f_v * b_d + lens.c_v};
}

inline std::vector<Eigen::Vector3d> simulated_board(const PatternScene& scene) {
  std::vector<Eigen::Vector3d> points;
  for (int j = 0; j < scene.rows; ++j) {
    for (int i = 0; i < scene.columns; ++i)
      points.emplace_back((scene.staggered ? 2 * i + j % 2 : i) * scene.square_m,
                          j * scene.square_m, 0);
  }
  return points;
}

// Half-way between the first and the last.
inline Eigen::Vector3d centre_of(const std::vector<Eigen::Vector3d>& board) {
  return 0.5 * (board.front() + board.back());
}

// Where a point is seen that is at in_camera(row) when this row is exposed: row = v(row), by the secant through two guesses.
template <class InCamera>
Eigen::Vector2d seen_pixel(const SimulatedLens& lens, double row_guess, const InCamera& in_camera) {
  double before = row_guess;
  Eigen::Vector2d u = simulated_pixel(lens, in_camera(before));
  double miss_before = u.y() - before;
  double row = u.y();
  for (int step = 0; step < 20 && std::abs(row - before) > 1e-10; ++step) {
    u = simulated_pixel(lens, in_camera(row));
    const double miss = u.y() - row;
    const double next =
        miss == miss_before ? row : row - miss * (row - before) / (miss - miss_before);
    before = row;
    miss_before = miss;
    row = next;
  }
  return u;
}

// All that the moving camera sees; frames of which less than six points are in the image are empty.
inline PatternData simulate_pattern(const PatternScene& scene) {
  PatternData data;
  data.width = scene.width;
  data.height = scene.height;
  data.points_m = simulated_board(scene);
  const Eigen::Vector3d centre = centre_of(data.points_m);
  const HandMotion motion(scene.seed, scene.speed, scene.hand);
  std::mt19937_64 random(scene.seed + 1000);
  std::normal_distribution<double> noise(0, scene.noise_px);
  std::uniform_real_distribution<double> uniform(0, 1);
  const int frames = static_cast<int>(scene.duration_s * scene.rate_hz);
  for (int f = 0; f < frames; ++f) {
    PatternFrame frame;
    frame.time_s = f / scene.rate_hz;
    const bool seen = uniform(random) >= scene.missing_frames;
    for (std::size_t k = 0; seen && k < data.points_m.size(); ++k) {
      Eigen::Vector2d u = seen_pixel(scene.lens, 0.5 * scene.height, [&](double row) {
        return motion.in_camera(data.points_m[k], centre,
                                frame.time_s + row * scene.lens.line_delay_s);
      });
      if (u.x() < 4 || u.y() < 4 || u.x() > scene.width - 4 || u.y() > scene.height - 4) continue;
      u += Eigen::Vector2d(noise(random), noise(random));
      if (uniform(random) < scene.wrong)
        u += 20 * Eigen::Vector2d(uniform(random) - 0.5, uniform(random) - 0.5);
      frame.observations.push_back({static_cast<int>(k), u});
    }
    if (frame.observations.size() < 6) frame.observations.clear();
    data.frames.push_back(std::move(frame));
  }
  return data;
}

}  // namespace alidade::test

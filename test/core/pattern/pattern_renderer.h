#pragma once
// Images of a chessboard before the moving camera of pattern_simulation.h, row by row: each sample of a pixel is a ray at its own
// row's time, meets the board's plane, and is black, white or table. Shares no mathematics with core/pattern.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "test/core/pattern/pattern_simulation.h"

namespace alidade::test {

struct RenderOptions {
  int samples = 3;        // a side of a pixel
  double exposure_s = 0;  // of each row, spread over the samples
  double noise = 1;       // grey levels
  double black = 40, white = 210, table = 120;
};

class PatternRenderer {
 public:
  PatternRenderer(const PatternScene& scene, const RenderOptions& options)
      : scene_(scene), options_(options), motion_(scene.seed, scene.speed, scene.hand) {
    const int n = options.samples;
    rays_.reserve(static_cast<std::size_t>(scene.width * scene.height * n * n));
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        for (int k = 0; k < n * n; ++k)
          rays_.push_back(ray(u + (k % n + 0.5) / n, v + (k / n + 0.5) / n));
      }
    }
  }

  // 8-bit luma, rows without padding, of the frame whose row 0 is exposed about time_s.
  [[nodiscard]] std::vector<std::uint8_t> image(double time_s) const {
    std::mt19937 random(
        static_cast<unsigned>(scene_.seed * 7919 + static_cast<std::uint64_t>(time_s * 1e4)));
    std::normal_distribution<float> noise(0, static_cast<float>(options_.noise));
    const int n = options_.samples;
    const int count = n * n;
    const double s = scene_.square_m;
    const Eigen::Vector3d centre(0.5 * (scene_.columns - 1) * s, 0.5 * (scene_.rows - 1) * s, 0);
    std::vector<std::uint8_t> out(static_cast<std::size_t>(scene_.width * scene_.height));
    // By the row within the pixel, and by when in the exposure: neighbours take turns, so that neither hangs on the other.
    std::vector<Eigen::Matrix3d> to_board(static_cast<std::size_t>(n * count));
    for (int v = 0; v < scene_.height; ++v) {
      for (int k = 0; k < n * count; ++k) {
        const double row = v + (k / count + 0.5) / n;
        const double in_exposure = ((k % count + 0.5) / count - 0.5) * options_.exposure_s;
        const double t = time_s + row * scene_.lens.line_delay_s + in_exposure;
        // Columns: the images of the board's axes and origin. Its inverse takes a ray to the board's homogeneous place.
        const Eigen::Vector3d origin = motion_.in_camera({0, 0, 0}, centre, t);
        Eigen::Matrix3d H;
        H << motion_.in_camera({1, 0, 0}, centre, t) - origin,
            motion_.in_camera({0, 1, 0}, centre, t) - origin, origin;
        to_board[static_cast<std::size_t>(k)] = H.inverse();
      }
      for (int u = 0; u < scene_.width; ++u) {
        double sum = 0;
        for (int k = 0; k < count; ++k) {
          const Eigen::Vector2d& r =
              rays_[static_cast<std::size_t>((v * scene_.width + u) * count + k)];
          const int phase = (5 * k + 3 * u + 7 * v) % count;
          const Eigen::Vector3d place = to_board[static_cast<std::size_t>(k / n * count + phase)] *
                                        Eigen::Vector3d(r.x(), r.y(), 1);
          sum += brightness(place.x() / place.z() / s, place.y() / place.z() / s);
        }
        const double value = sum / count + noise(random);
        out[static_cast<std::size_t>(v * scene_.width + u)] =
            static_cast<std::uint8_t>(std::lround(std::min(255.0, std::max(0.0, value))));
      }
    }
    return out;
  }

 private:
  // x, y in squares from the first inner corner.
  [[nodiscard]] double brightness(double x, double y) const {
    if (x < -2 || y < -2 || x > scene_.columns + 1 || y > scene_.rows + 1) return options_.table;
    if (x < -1 || y < -1 || x > scene_.columns || y > scene_.rows) return options_.white;
    const int square = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
    return (square & 1) == 0 ? options_.black : options_.white;
  }

  // The direction (x, y, 1) that the lens shows at this place, by fixed-point iteration.
  [[nodiscard]] Eigen::Vector2d ray(double u, double v) const {
    Eigen::Vector2d r((u - scene_.lens.c_u) / scene_.lens.f_u,
                      (v - scene_.lens.c_v) / scene_.lens.f_v);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d there = simulated_pixel(scene_.lens, {r.x(), r.y(), 1});
      r += Eigen::Vector2d((u - there.x()) / scene_.lens.f_u, (v - there.y()) / scene_.lens.f_v);
    }
    return r;
  }

  PatternScene scene_;
  RenderOptions options_;
  HandMotion motion_;
  std::vector<Eigen::Vector2d> rays_;
};

}  // namespace alidade::test

#include "test/simulator/pattern_renderer.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace alidade::simulator {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kStep_px = 0.7;  // of motion between two moments of an exposure
constexpr int kMostMoments = 64;
constexpr double kFingerBrightness = 0.3;
constexpr double kFingerReach = 1.2;  // of half the board

}  // namespace

PatternRenderer::PatternRenderer(const Config& config)
    : config_(config),
      board_(*config.pattern),
      camera_(config, board_.centre()),
      noise_(config.sensor, config.seed) {
  for (int v = 0; v <= config.image.height; ++v) {
    for (int u = 0; u <= config.image.width; ++u)
      slopes_.push_back(camera_.slope({u + 0.5, v + 0.5}));
  }
}

Matrix3d PatternRenderer::plane_from_camera(double time_s) const {
  const CameraPose pose = camera_.pose(time_s);
  Matrix3d camera_from_plane;
  camera_from_plane << pose.R_camera_from_pattern.leftCols<2>(), pose.pattern_in_camera;
  return camera_from_plane.inverse();
}

PatternRenderer::Extent PatternRenderer::extent(double t0_s) const {
  constexpr int kSteps = 8;      // along an edge of the board
  constexpr double kMargin = 4;  // px
  const int width = config_.image.width;
  const int height = config_.image.height;
  const double exposure = config_.sensor.exposure;
  const double readout = config_.camera.line_delay * height;
  const Vector2d half = (board_.high() - board_.low()) / 2;
  const Vector2d reach =
      config_.pattern->finger > 0
          ? Vector2d(kFingerReach * half + Vector2d::Constant(config_.pattern->finger / 2))
          : half;
  Eigen::AlignedBox2d box;
  double blur = 0;
  bool all_seen = true;
  for (int i = 0; i < 4 * kSteps; ++i) {
    const double along = 2.0 * (i % kSteps) / kSteps - 1;
    const Vector2d edge = i / kSteps == 0   ? Vector2d(along, -1)
                          : i / kSteps == 1 ? Vector2d(1, along)
                          : i / kSteps == 2 ? Vector2d(-along, 1)
                                            : Vector2d(-1, -along);
    const Vector2d place = board_.centre() + reach.cwiseProduct(edge);
    for (const double part : {0.0, 0.5, 1.0}) {
      const double time = t0_s + part * readout;
      const auto before = camera_.project(place, time - exposure / 2);
      const auto after = camera_.project(place, time + exposure / 2);
      all_seen = all_seen && before && after;
      if (!before || !after) continue;
      blur = std::max(blur, (*after - *before).norm());
      box.extend(*before);
      box.extend(*after);
    }
  }
  Extent extent{0, 0, width, height, 1};
  if (all_seen) {
    extent.left = static_cast<int>(std::clamp(box.min().x() - kMargin, 0.0, double(width)));
    extent.top = static_cast<int>(std::clamp(box.min().y() - kMargin, 0.0, double(height)));
    extent.right = static_cast<int>(std::clamp(box.max().x() + kMargin, 0.0, double(width)));
    extent.bottom = static_cast<int>(std::clamp(box.max().y() + kMargin, 0.0, double(height)));
  }
  if (exposure > 0) extent.moments = std::min(kMostMoments, 2 + static_cast<int>(blur / kStep_px));
  return extent;
}

// Round the board, now before its middle, now beside it.
Vector2d PatternRenderer::finger(double time_s) const {
  const Vector2d half = (board_.high() - board_.low()) / 2;
  return board_.centre() + kFingerReach * Vector2d(half.x() * std::cos(0.9 * time_s),
                                                   half.y() * std::sin(1.3 * time_s));
}

Vector2d PatternRenderer::pixel_box(const Matrix3d& H, double z, const Vector2d& place,
                                    const Vector2d* slopes) const {
  Eigen::Matrix2d J;
  J << H.topLeftCorner<2, 2>() - place * H.block<1, 2>(2, 0);
  return ((J * (slopes[1] - slopes[0])).cwiseAbs() +
          (J * (slopes[config_.image.width + 1] - slopes[0])).cwiseAbs()) /
         z;
}

std::vector<std::uint8_t> PatternRenderer::render(double t0_s, std::int64_t sequence) const {
  const int width = config_.image.width;
  const int height = config_.image.height;
  const double exposure = config_.sensor.exposure;
  const double finger_radius = config_.pattern->finger / 2;
  const Extent where = extent(t0_s);
  std::vector<std::uint8_t> image(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(height));
  std::vector<double> grey(static_cast<std::size_t>(width));
  std::vector<Vector2d> boxes(static_cast<std::size_t>(width), Vector2d::Constant(1e-3));
  for (int row = 0; row < height; ++row) {
    const double row_time = t0_s + (row + 0.5) * config_.camera.line_delay;
    std::fill(grey.begin(), grey.end(), 255 * config_.pattern->table);
    const bool seen = row >= where.top && row < where.bottom;
    const Vector2d* slopes = &slopes_[static_cast<std::size_t>(row * (width + 1))];
    for (int i = 0; seen && i < where.moments; ++i) {
      const double time = row_time + exposure * ((i + 0.5) / where.moments - 0.5);
      const Matrix3d H = plane_from_camera(time);
      const Vector2d finger_centre = finger(time);
      for (int u = where.left; u < where.right; ++u) {
        const auto column = static_cast<std::size_t>(u);
        const Vector3d place = H * slopes[u].homogeneous();
        double value = config_.pattern->table;
        if (place.z() > 0) {
          const Vector2d p = place.head<2>() / place.z();
          if (i == 0) boxes[column] = pixel_box(H, place.z(), p, slopes + u);
          const Vector2d& box = boxes[column];
          value = board_.brightness(p, box);
          if (finger_radius > 0) {
            const Vector2d from = p - finger_centre;
            const double distance = from.norm();
            if (distance > 1e-9 && distance < finger_radius + box.sum()) {
              const double cover = box_cover(finger_radius - distance, from / distance, box);
              value += cover * (kFingerBrightness - value);
            }
          }
        }
        // The mean so far.
        grey[column] += (255 * value - grey[column]) / (i + 1);
      }
    }
    noise_.digitise(sequence, row, grey,
                    &image[static_cast<std::size_t>(row) * static_cast<std::size_t>(width)]);
  }
  return image;
}

}  // namespace alidade::simulator

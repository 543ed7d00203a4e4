#pragma once
// A scene of one grey level; things are painted into the picture, and boxes are of what changed.

#include <gtest/gtest.h>

#include <vector>

#include "core/detection/change_regions.h"
#include "core/detection/frame_match.h"
#include "core/detection/spline_image.h"

namespace alidade::test {

inline constexpr int kWide = 100;
inline constexpr int kHigh = 60;
inline constexpr int kScene = 100;  // grey levels

inline DetectionBox box_of(double u, double v, double width, double height) {
  DetectionBox out;
  out.u = u;
  out.v = v;
  out.width = width;
  out.height = height;
  out.score = 7;
  return out;
}
inline DetectionBox row_of(double u, double width) { return box_of(u, 20, width, 12); }

class ChangedScene {
 public:
  void paint(const DetectionBox& where, int grey) {
    each_pixel(where, [&](std::size_t at) {
      pixels_[at] = static_cast<std::uint16_t>(kSmoothUnit * grey);
    });
  }
  // z: sigmas.
  void change(const DetectionBox& where, int z) {
    each_pixel(where, [&](std::size_t at) {
      z_[at] = static_cast<std::int16_t>(z * ChangeRegions::kUnit);
    });
    boxes.push_back(where);
  }

  [[nodiscard]] SmoothedView view() const { return {pixels_.data(), kWide, kHigh}; }
  [[nodiscard]] const std::int16_t* z() const { return z_.data(); }
  // The left edges of those that are there.
  [[nodiscard]] std::vector<double> left_edges() const {
    std::vector<double> left;
    for (const DetectionBox& box : boxes) {
      EXPECT_EQ(box.score, 7);
      left.push_back(box.u);
    }
    return left;
  }

  std::vector<DetectionBox> boxes;

 private:
  template <typename Act>
  static void each_pixel(const DetectionBox& where, Act&& act) {
    for (int v = static_cast<int>(where.v); v < where.v + where.height; ++v) {
      for (int u = static_cast<int>(where.u); u < where.u + where.width; ++u) {
        act(static_cast<std::size_t>(v * kWide + u));
      }
    }
  }

  std::vector<std::uint16_t> pixels_ =
      std::vector<std::uint16_t>(kWide * kHigh, kSmoothUnit* kScene);
  std::vector<std::int16_t> z_ = std::vector<std::int16_t>(kWide * kHigh);
};

}  // namespace alidade::test

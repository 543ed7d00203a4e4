#pragma once
// What an SVG file, as `alidade calibrate-shutter --print` writes it, makes black on its page: rectangles and circles that a
// translation moves. Nothing else of SVG is read.

#include <Eigen/Geometry>
#include <filesystem>
#include <vector>

namespace alidade::simulator {

struct PrintedPage {
  struct Circle {
    Eigen::Vector2d centre;
    double radius;
  };
  Eigen::Vector2d size;  // m, as all here; from the page's upper left corner
  std::vector<Eigen::AlignedBox2d> rectangles;
  std::vector<Circle> circles;
};

// Throws ConfigError: it cannot be read, or is not in millimetres.
[[nodiscard]] PrintedPage read_printed_page(const std::filesystem::path& file);

}  // namespace alidade::simulator

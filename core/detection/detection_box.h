#pragma once
// DetectionBox: a detection in a picture, found by this folder or elsewhere: its smallest upright
// rectangle and its score. Pixels as in CONVENTIONS.md: the box spans [u, u + width] x [v, v +
// height]. One around the top-left pixel alone is (0, 0, 1, 1).

#include <string>

#include "core/model/linear_algebra.h"

namespace alidade {

struct DetectionBox {
  double u = 0;       // px, left edge
  double v = 0;       // px, upper edge
  double width = 0;   // px
  double height = 0;  // px
  double score = 1;   // larger is surer, on the detector's scale; 0 to 1 from another program
  std::string name;   // class; empty: unknown

  [[nodiscard]] Vector2<double> foot() const { return {u + width / 2, v + height}; }
  [[nodiscard]] Vector2<double> middle() const { return {u + width / 2, v + height / 2}; }
};

// Intersection over union, 0 to 1.
[[nodiscard]] double overlap(const DetectionBox& a, const DetectionBox& b);

}  // namespace alidade

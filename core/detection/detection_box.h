#pragma once
// DetectionBox: a detection in an image, found by this folder or by another program: its smallest
// upright rectangle and its score. Pixels as in CONVENTIONS.md: the box spans [u, u + width] x [v,
// v + height]. The box around the top-left pixel alone is (0, 0, 1, 1).

#include <string>

#include "core/model/linear_algebra.h"

namespace alidade {

struct DetectionBox {
  double u = 0;       // px, left edge
  double v = 0;       // px, upper edge
  double width = 0;   // px
  double height = 0;  // px
  double score = 1;   // larger is surer; the scale is the detector's; another program's is 0 to 1
  std::string name;   // class; empty: unknown; its length is limited where boxes come in

  // px; foot(): the middle of the lower edge.
  [[nodiscard]] Vector2<double> foot() const { return {u + width / 2, v + height}; }
  [[nodiscard]] Vector2<double> middle() const { return {u + width / 2, v + height / 2}; }
};

// Intersection over union, 0 to 1. 0 if the boxes only touch, or one of them is empty.
[[nodiscard]] double overlap(const DetectionBox& a, const DetectionBox& b);

}  // namespace alidade

#pragma once
// What a detector, of this folder or from outside, says of one thing in the picture: the smallest upright rectangle around it, and how sure it is.
// Pixels as everywhere (CONVENTIONS.md): the box spans [u, u + width] x [v, v + height], and one that holds the top-left pixel alone
// is (0, 0, 1, 1).

#include <string>

#include "core/model/linear_algebra.h"

namespace alidade {

struct DetectionBox {
  double u = 0;       // px, left edge
  double v = 0;       // px, upper edge
  double width = 0;   // px
  double height = 0;  // px
  double score = 1;   // the larger the surer; its scale is the detector's, from outside 0 to 1
  std::string name;   // its class; empty: not told

  [[nodiscard]] Vector2<double> foot() const { return {u + width / 2, v + height}; }
  [[nodiscard]] Vector2<double> middle() const { return {u + width / 2, v + height / 2}; }
};

// Area in common over area together, 0 to 1.
[[nodiscard]] double overlap(const DetectionBox& a, const DetectionBox& b);

}  // namespace alidade

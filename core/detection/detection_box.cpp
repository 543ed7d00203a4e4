#include "core/detection/detection_box.h"

#include <algorithm>

namespace alidade {

double overlap(const DetectionBox& a, const DetectionBox& b) {
  const double width = std::min(a.u + a.width, b.u + b.width) - std::max(a.u, b.u);
  const double height = std::min(a.v + a.height, b.v + b.height) - std::max(a.v, b.v);
  if (!(width > 0 && height > 0)) return 0;
  const double common = width * height;
  return common / (a.width * a.height + b.width * b.height - common);
}

}  // namespace alidade

#include "core/detection/detection_box.h"

#include <algorithm>

namespace alidade {

double overlap(const DetectionBox& a, const DetectionBox& b) {
  const double width = std::min(a.left + a.width, b.left + b.width) - std::max(a.left, b.left);
  const double height = std::min(a.top + a.height, b.top + b.height) - std::max(a.top, b.top);
  if (!(width > 0 && height > 0)) return 0;
  const double common = width * height;
  return common / (a.width * a.height + b.width * b.height - common);
}

}  // namespace alidade

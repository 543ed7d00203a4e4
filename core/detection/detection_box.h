#pragma once
// What a detector says of one thing in the picture: an upright box and how sure it is.
// Pixels as everywhere (CONVENTIONS.md): the box spans [left, left + width] x [top, top + height], and one that holds the top-left pixel alone
// is (0, 0, 1, 1).

namespace alidade {

struct DetectionBox {
  double left = 0;    // px
  double top = 0;     // px
  double width = 0;   // px
  double height = 0;  // px
  double score = 0;   // the larger the surer; its scale is the detector's
  int kind = 0;       // class, of detectors that know several
};

// Area in common over area together, 0 to 1.
[[nodiscard]] double overlap(const DetectionBox& a, const DetectionBox& b);

}  // namespace alidade

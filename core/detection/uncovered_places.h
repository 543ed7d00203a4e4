#pragma once
// drop_uncovered_places(): a large, slow target whose earlier places overlap changes the image
// twice: at its front, and behind it, where the scene reappears. The second change is no target. If
// no earlier image shows the target elsewhere, the present one decides: one of the two places
// became brighter, the other darker, and the target is between them:
//   |m - a| < |m - b| / 2   =>   a is the front, b was uncovered
// a, b: mean grey levels of the boxes' changed pixels, m: of the line between their middles.
// Conditions and limits: docs/derivations.md.

#include <vector>

#include "core/detection/detection_box.h"
#include "core/detection/frame_match.h"

namespace alidade {

// Drops boxes of uncovered places; the others keep their order. All scores must be > 0. z: row by
// row, the values from which the boxes were made (change_regions.h).
void drop_uncovered_places(const SmoothedView& now, const std::int16_t* z,
                           std::vector<DetectionBox>* boxes);

}  // namespace alidade

#pragma once
// A target so large and slow that its earlier places overlap changes the picture twice: at its front, and behind it, where the scene comes out
// again. The second is no thing. Where the target has not been seen elsewhere before, no earlier picture tells them apart; the picture at hand does. One of them
// became brighter and the other darker, and between them is the target itself:
//   |m - a| < |m - b| / 2   =>   a is the front, b was uncovered
// a, b: mean grey levels of the two boxes' changed pixels, m that of the pixels on the line between the boxes' middles. What was uncovered is narrower
// than what lies between, as the earlier places overlap, and both are no farther apart than the larger of them is large, at least 12 px. A bright and a dark
// target that pass each other have the scene between them, which is near to neither: both stay.

#include <vector>

#include "core/detection/detection_box.h"
#include "core/detection/frame_match.h"

namespace alidade {

// Leaves out boxes of what was uncovered; the order of the others stays. z: what the boxes were made of (change_regions.h), row after row.
void drop_uncovered_places(const SmoothedView& now, const std::int16_t* z,
                           std::vector<DetectionBox>* boxes);

}  // namespace alidade

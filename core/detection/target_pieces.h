#pragma once
// join_target_pieces(): a target that is large for its speed changes the image only along its
// outline: its inside, of one grey level, covers itself in the earlier images. So pieces of the
// outline are found around an unchanged inside. In at least one piece most changed pixels have the
// grey level of the inside. Two boxes belong to one target if they are no farther apart than
// merge_px, or at most twice the larger one's size and
//   |g - m| < c / 3   for three quarters of the pixels between the boxes, and
//   |g - m| < c / 2   for most changed pixels of one of the boxes
// g: grey level, m: its median on the line between the boxes' middles, c: mean change of that box's
// changed pixels. Conditions and limits: docs/derivations.md.

#include <vector>

#include "core/detection/change_regions.h"
#include "core/detection/detection_box.h"
#include "core/detection/frame_match.h"

namespace alidade {

// Joins boxes of one target unless the result is larger than most_size_px; the other boxes keep
// their order. z: row by row, the values from which the boxes were made (change_regions.h).
// sigma_grey: the difference in grey levels that has z = 1 in an even area.
void join_target_pieces(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
                        const ChangeOptions& options, std::vector<DetectionBox>* boxes);

}  // namespace alidade

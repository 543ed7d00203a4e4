#pragma once
// join_target_pieces(): a target that is large for its speed changes the picture only along its
// outline: its inside, of one grey level, covers itself in the earlier pictures. So pieces of the
// outline are found around an unchanged inside. In at least one piece most changed pixels have the
// grey level of the inside. Two boxes are of one thing if
//   |g - m| < c / 3   for three quarters of the pixels between the boxes, and
//   |g - m| < c / 2   for most changed pixels of one of the boxes
// g: grey level, m: its median on the line between the boxes' middles, c: mean change of the box's
// changed pixels. Conditions and limits: docs/derivations.md.

#include <vector>

#include "core/detection/change_regions.h"
#include "core/detection/detection_box.h"
#include "core/detection/frame_match.h"

namespace alidade {

// Joins boxes of one thing up to most_size_px; the others keep their order. z: row by row, the
// values that the boxes were made from (change_regions.h). sigma_grey: grey levels of a difference
// with z = 1 in an even area.
void join_target_pieces(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
                        const ChangeOptions& options, std::vector<DetectionBox>* boxes);

}  // namespace alidade

#pragma once
// A target that is large for its speed changes the picture along its outline only: where its inside is of one grey level, that lies over itself in the
// earlier pictures. The pieces of the outline then stand around what has not changed and has the target's grey level, which is what most of the changed
// pixels of one of them show, too:
//   |g - m| < c / 3   for three quarters of the pixels between,   |g - m| < c / 2   for most of the changed ones of a box   =>   both boxes are of one thing
// g: grey level, m the median of the pixels on the line between the boxes' middles, c by how much the box's changed pixels differ from before, the mean: what is nearer
// to m than c / 2 is not the scene. Boxes are no farther apart than twice the larger of them is large. Two targets before an
// even sky stay two: between them is the sky, which neither shows; so do two before a scene of many grey levels. A box that has grown takes what it has come near to.

#include <vector>

#include "core/detection/change_regions.h"
#include "core/detection/detection_box.h"
#include "core/detection/frame_match.h"

namespace alidade {

// Joins boxes of one thing, as long as they come to no more than most_size_px; the order of the others stays. z: what the boxes were made of
// (change_regions.h), row after row; sigma_grey: a difference of that many grey levels is a z of 1 in an even area.
void join_target_pieces(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
                        const ChangeOptions& options, std::vector<DetectionBox>* boxes);

}  // namespace alidade

#pragma once
// Searches each image of a recording or a video file for the pattern.

#include <functional>
#include <string>

#include "edge_app/commands/pattern_search.h"

namespace alidade {

// video: a recording's directory or a video file. progress: called after each image with the number
// of images so far and the number of these in which the pattern was found; if it returns false, the
// search ends with CommandError. Also throws CommandError if there is no readable video or the
// image size changes.
[[nodiscard]] PatternVideo find_pattern(const std::string& video, const KnownPattern& pattern,
                                        const std::function<bool(int images, int found)>& progress);

}  // namespace alidade

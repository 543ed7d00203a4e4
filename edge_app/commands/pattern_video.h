#pragma once
// Searches the images of a recording or a video file for the pattern, except those that repeat the
// one before (PatternSearch).

#include <functional>
#include <string>

#include "edge_app/commands/pattern_search.h"

namespace alidade {

// video: a recording's directory or a video file. progress: called after each image, with the
// number of images so far, repeated ones included, and the number of these in which the pattern was
// found. Throws CommandError if progress returns false; if there is no video, or it cannot be read
// to its end or has no images; if an image is too small for a pattern, or has another size than the
// first; if fewer than three images were searched; if time stamps do not increase.
[[nodiscard]] PatternVideo find_pattern(const std::string& video, const KnownPattern& pattern,
                                        const std::function<bool(int images, int found)>& progress);

}  // namespace alidade

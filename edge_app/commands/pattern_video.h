#pragma once
// The pattern in a recording or a video file, every image of it.

#include <functional>
#include <string>

#include "edge_app/commands/pattern_search.h"

namespace alidade {

// progress: images so far; false ends the reading (CommandError). Throws CommandError: no or unreadable video, images that change
// their size.
[[nodiscard]] PatternVideo find_pattern(const std::string& video, const KnownPattern& pattern,
                                        const std::function<bool(int images, int found)>& progress);

}  // namespace alidade

#pragma once
// The frames of a video with the pattern's points in them, on a steady clock: repeated images left out, lost ones noticed, stamps
// that jitter put right (fit_clock_line). Throws CommandError: no or unreadable video, images that change their size.

#include <functional>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/pattern_data.h"

namespace alidade {

struct PatternVideo {
  PatternData data;
  int images = 0;                    // read
  int repeated = 0;                  // the same image again
  int found = 0;                     // images with the pattern
  int lost = 0;                      // by the stamps
  std::vector<std::string> remarks;  // about the video
};

// progress: images so far; false ends the reading (CommandError).
[[nodiscard]] PatternVideo find_pattern(const std::string& video, const KnownPattern& pattern,
                                        const std::function<bool(int images, int found)>& progress);

}  // namespace alidade

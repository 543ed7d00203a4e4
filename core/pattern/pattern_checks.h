#pragma once
// What can be said of a video of a known pattern before anything is estimated: is it what pattern_data.h says, does the pattern
// move in the image, how much of it does it fill? For messages that say what would help.

#include <optional>
#include <string>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"

namespace alidade::internal {

// One line: the first thing that is not as pattern_data.h says, and where. Empty: nothing.
[[nodiscard]] std::optional<std::string> bad_input(const PatternData& data);

struct PatternViews {
  int frames = 0;        // that show the pattern
  double travel_px = 0;  // of a point: diagonal of the box of all its places, median of points
  double extent =
      0;  // largest side of the box of a frame's points, part of the image's same side; median of frames
};
[[nodiscard]] PatternViews views_of(const PatternData& data);

// Median time from one frame to the next, s; 0 with less than two.
[[nodiscard]] double frame_interval(const PatternData& data);

// Below which going nearer helps most: part of the image.
inline constexpr double kSmallExtent = 0.25;

// Of the points that both frames show, in the order of points: median of how far they moved, px; 0 where they share none.
[[nodiscard]] double shift_between(const PatternFrame& a, const PatternFrame& b);

inline constexpr const char* kMoveFaster =
    "move the camera faster, in all directions and by turning it";

// How to move, in words; nearer first if the pattern is small in the image.
[[nodiscard]] std::string how_to_move(const PatternViews& views);
[[nodiscard]] std::string how_to_show(const PatternViews& views);

// std::snprintf into a string.
[[nodiscard]] std::string formatted(const char* format, double a, double b = 0);

}  // namespace alidade::internal

#pragma once
// Checks of a video of a known pattern before anything is estimated: whether it is as
// pattern_data.h says, how far the pattern moves in the image, how much of the image it fills. They
// also word what would help.

#include <optional>
#include <string>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"

namespace alidade::internal {

// One line: the first violation of pattern_data.h, and where. Empty: none.
[[nodiscard]] std::optional<std::string> bad_input(const PatternData& data);

struct PatternViews {
  int frames = 0;        // that show the pattern
  double travel_px = 0;  // diagonal of the box of all places of a point; median over points
  // Larger side of the box of a frame's points, as a share of the image's same side; median over
  // frames.
  double extent = 0;
};
[[nodiscard]] PatternViews views_of(const PatternData& data);

// Median time from one frame to the next, s; 0 with fewer than two frames.
[[nodiscard]] double frame_interval(const PatternData& data);

// Share of the image below which going nearer helps most.
inline constexpr double kSmallExtent = 0.25;

// Median distance that the points of both frames moved, px; 0 if they share none. Observations must
// be ordered by point.
[[nodiscard]] double shift_between(const PatternFrame& a, const PatternFrame& b);

inline constexpr const char* kMoveFaster =
    "move the camera faster, in all directions and by turning it";

// How to move, in words. Going nearer comes first if the pattern is small in the image.
[[nodiscard]] std::string how_to_move(const PatternViews& views);
[[nodiscard]] std::string how_to_show(const PatternViews& views);

// std::snprintf into a string of at most 319 characters. format: takes doubles, at most two.
[[nodiscard]] std::string formatted(const char* format, double a, double b = 0);

}  // namespace alidade::internal

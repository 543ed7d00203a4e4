#pragma once
// progress_of(): what a video of a known pattern has shown so far, while it is taken; whether this
// suffices for a calibration; and what would help if it does not. In simulated recordings that meet
// the limits, lens and line delay are as precise as a video of the same length can make them
// (test/core/pattern/pattern_progress_test). Times need not be steady. Pure; allocates; takes
// milliseconds, and a tenth of a second for the views' tilt.

#include <array>
#include <string>
#include <vector>

#include "core/pattern/pattern_data.h"

namespace alidade {

struct PatternProgress {
  double seen_s = 0;          // time during which consecutive frames show the pattern
  double unseen_s = 0;        // since the pattern was last seen, or since the first frame
  double last_seen_s = 0;     // when it was last seen, from the first frame on
  double found = 0;           // share of the last seconds' frames that show it
  double extent = 0;          // as PatternViews::extent
  double speed = 0;           // of points in the image, image heights/s, root mean square
  double unfollowed = 0;      // unfollowed_motion() of the last seconds' frames
  double distance_ratio = 1;  // farthest over nearest
  // rad; largest tilt with the pattern's left, right, upper and lower side nearer than the other.
  std::array<double, 4> tilt{};
  // For each ninth of the image, row by row: the share of its cells in which points were seen.
  std::array<double, 9> covered{};
};

// The default without frames. Observations must be ordered by point.
[[nodiscard]] PatternProgress progress_of(const PatternData& data);

// How well frames follow the motion: the distance of the points in the middle one of five frames
// from a cubic through the other four. Median over all fives that start after since_s, as a share
// of the image's height; 0 if there is none. Beyond some pixels the frames do not follow the
// motion.
[[nodiscard]] double unfollowed_motion(const PatternData& data, double since_s);

// Advice, one line each, most important first. Empty: everything was shown.
[[nodiscard]] std::vector<std::string> advice_of(const PatternProgress& progress);

// Everything was shown for long enough, and the last seconds were not too fast.
[[nodiscard]] bool is_enough(const PatternProgress& progress);

}  // namespace alidade

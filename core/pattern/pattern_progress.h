#pragma once
// What a video of a known pattern has shown so far, while it is taken: is that enough for a calibration, and if not, what would
// help? The marks are those beyond which simulated recordings give a lens and a line delay as sharp as a video of that length can
// (test/core/pattern/pattern_progress_test). Times need not be steady. Pure; allocates; takes milliseconds, and a tenth of a second
// for the views' tilt.

#include <array>
#include <string>
#include <vector>

#include "core/pattern/pattern_data.h"

namespace alidade {

struct PatternProgress {
  double seen_s = 0;          // time over which the pattern was seen in one frame after the other
  double unseen_s = 0;        // since it was last seen; never seen: since the first frame
  double last_seen_s = 0;     // when that was, since the first frame
  double found = 0;           // part of the last seconds' frames in which it was found
  double extent = 0;          // as PatternViews
  double speed = 0;           // of points in the image, image heights/s, root mean square
  double unfollowed = 0;      // as unfollowed_motion, of the last seconds' frames
  double distance_ratio = 1;  // farthest to nearest
  std::array<double, 4>
      tilt{};  // rad, by how much it was nearer by its left, right, upper, lower side
  // Of each ninth of the image, row by row: the part of its cells in which points were seen.
  std::array<double, 9> covered{};
};

[[nodiscard]] PatternProgress progress_of(const PatternData& data);

// By how much the points of the middle one of five frames lie from where the others say, were the motion a cubic in between: beyond some
// pixels the frames do not follow the motion. Median of the fives with more than `since_s` as their first time, part of the image's
// height; 0 without any.
[[nodiscard]] double unfollowed_motion(const PatternData& data, double since_s);

// What would help, one line each, what matters most first. Empty: all there is to show was shown.
[[nodiscard]] std::vector<std::string> advice_of(const PatternProgress& progress);

// All was shown, for long enough, and in the last seconds not too fast.
[[nodiscard]] bool is_enough(const PatternProgress& progress);

}  // namespace alidade

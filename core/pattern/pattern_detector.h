#pragma once
// PatternDetector: the points of a known pattern in an image. Chessboards, circle grids and ChArUco
// boards by OpenCV, tags by libapriltag, corners refined to a fraction of a pixel. One thread at a
// time.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/pattern_data.h"

namespace alidade {

class PatternDetector {
 public:
  static constexpr int kLeastImage_px = 32;  // smallest side of an image that is searched

  explicit PatternDetector(const KnownPattern& pattern);
  ~PatternDetector();
  PatternDetector(const PatternDetector&) = delete;
  PatternDetector& operator=(const PatternDetector&) = delete;

  // 8-bit luma, not null, row v at luma + v * stride, stride >= width. The observations are ordered
  // by point; empty if the pattern is not found, or a side is shorter than kLeastImage_px.
  [[nodiscard]] std::vector<PatternObservation> find(const std::uint8_t* luma, int width,
                                                     int height, std::ptrdiff_t stride);

  // One line: what the images so far showed in place of the pattern; empty if nothing is known, as
  // always with chessboards and circles.
  [[nodiscard]] std::string doubt() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A pattern that looks the same after half a turn may be numbered from the other end in some
// frames. Numbers each frame like the one before it, so that the camera's motion is continuous.
// Frames more than max_gap_s apart are not compared. Other patterns stay as they are.
void follow_half_turns(const KnownPattern& pattern, double max_gap_s, PatternData* data);

}  // namespace alidade

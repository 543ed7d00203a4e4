#pragma once
// Where the points of a known pattern are in an image: OpenCV's chessboards, circle grids and ChArUco boards, libapriltag's
// tags, corners to a fraction of a pixel by OpenCV. One thread at a time.

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
  static constexpr int kLeastImage_px = 32;  // a side of an image in which something can be found

  explicit PatternDetector(const KnownPattern& pattern);
  ~PatternDetector();
  PatternDetector(const PatternDetector&) = delete;
  PatternDetector& operator=(const PatternDetector&) = delete;

  // 8-bit luma, row v at luma + v * stride. The observations in increasing order of their points; empty: not found.
  [[nodiscard]] std::vector<PatternObservation> find(const std::uint8_t* luma, int width,
                                                     int height, std::ptrdiff_t stride);

  // One line, what was there in the pattern's place in the images so far; empty: nothing is known to be.
  [[nodiscard]] std::string doubt() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Of a pattern that looks the same after half a turn each frame may have been named either way round: names each as the frame
// before it, so that the camera's motion is one trajectory. What is longer than max_gap_s ago says nothing.
void follow_half_turns(const KnownPattern& pattern, double max_gap_s, PatternData* data);

}  // namespace alidade

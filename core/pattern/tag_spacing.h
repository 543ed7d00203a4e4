#pragma once
// What tags in images tell of the grid that they are printed in, whatever it is said to be: the gap between them, by the cross
// ratio of the four corners on a line of edges, and how they are numbered. Times and lens do not matter.

#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

struct NumberedTag {
  int id;
  std::vector<cv::Point2f> corners;  // in the order of KnownPattern::points_m, OpenCV's pixels
};

class TagSpacing {
 public:
  // pattern: what the grid is said to be.
  explicit TagSpacing(const KnownPattern& pattern) : pattern_(pattern), gap_(pattern.gap) {}

  // Those of one image. rough: corners may be half a pixel off.
  void add(const std::vector<NumberedTag>& tags, bool rough);

  // Between tags, a part of their side: as it is said to be, unless it is known to be another.
  [[nodiscard]] double gap() const { return gap_; }

  // One line, what is otherwise than it is said to be; empty: nothing is known to be.
  [[nodiscard]] std::string doubt() const;

 private:
  [[nodiscard]] double measured_gap() const;

  KnownPattern pattern_;
  double gap_;
  std::vector<double> gaps_, rough_gaps_;  // parts of a tag's side
  std::map<int, int> steps_upward_;  // how often a tag above another had a number larger by so many
};

}  // namespace alidade::internal

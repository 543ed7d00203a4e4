#pragma once
// TagSpacing: measures the grid in which tags are printed, independently of its name: the gap
// between tags, by the cross ratio of the four corners on a line of edges, and the order of their
// numbers. Independent of times and lens.

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
  // pattern: the grid as it was named.
  explicit TagSpacing(const KnownPattern& pattern) : pattern_(pattern), gap_(pattern.gap) {}

  // Adds the tags of one image. rough: corners may be half a pixel off; they count only until there
  // are enough others.
  void add(const std::vector<NumberedTag>& tags, bool rough);

  // Gap between tags, as a share of their side: the named one, unless it was measured to differ.
  [[nodiscard]] double gap() const { return gap_; }

  // One line about what differs from the name; empty if nothing is known to differ.
  [[nodiscard]] std::string doubt() const;

 private:
  [[nodiscard]] double measured_gap() const;

  KnownPattern pattern_;
  double gap_;
  std::vector<double> gaps_, rough_gaps_;  // parts of a tag's side
  std::map<int, int> steps_upward_;        // how often the tag above had a number larger by this
};

}  // namespace alidade::internal

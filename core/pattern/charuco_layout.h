#pragma once
// Which squares of a ChArUco board hold which markers, and which of the markers found in an image are this board's: a marker counts if it
// and its neighbours lie where each lets expect the other, as wrongly read ones do not. A board of an even number of rows had its colours,
// and so its markers, the other way round before OpenCV 4.6: most neighbours in the images so far decide. Until then none counts: a part
// of the board may fit both. One thread at a time.

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

// Where a homography maps a place to.
[[nodiscard]] cv::Point2d mapped(const cv::Matx33d& H, const cv::Point2d& p);

class CharucoLayout {
 public:
  explicit CharucoLayout(const KnownPattern& pattern);

  // Places on the board are in squares, x along the rows, y down, from its first inner corner.
  struct Marker {
    int id;
    cv::Matx33d image_from_board;  // OpenCV's pixels
    double square_px;              // at least, about it
  };
  // Those that count in this image, 8-bit grey.
  [[nodiscard]] std::vector<Marker> markers_in(const cv::Mat& image);

  // By marker, the middle of its square.
  [[nodiscard]] const std::vector<cv::Point2d>& middles() const { return middles_[chosen_]; }
  [[nodiscard]] bool is_black(int column, int row) const;  // of squares
  // Images so far in which some markers of the dictionary were found.
  [[nodiscard]] int images_with_markers() const { return images_with_markers_; }
  // Markers agree, but as well in one layout as in the other.
  [[nodiscard]] bool is_undecided() const;
  // Where they were found in none: another dictionary, many of whose markers were.
  [[nodiscard]] std::optional<int> other_dictionary() const { return other_dictionary_; }

 private:
  // In some of the images only, for one dictionary at a time: it takes as long as to look for the right one.
  void look_for_others(const cv::Mat& image);
  // 1: each lies where the other lets expect it, -1: not, 0: too far from each other to tell. Both homographies still from their
  // own square's middle.
  [[nodiscard]] int agreement(const Marker& a, const Marker& b, std::size_t layout) const;

  KnownPattern pattern_;
  std::array<std::vector<cv::Point2d>, 2> middles_;  // from OpenCV 4.6 on, before
  std::array<int, 2> votes_ = {};
  std::size_t chosen_ = 0;
  int images_with_markers_ = 0;
  int images_without_ = 0;
  std::optional<int> other_dictionary_;
};

}  // namespace alidade::internal

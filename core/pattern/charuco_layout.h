#pragma once
// CharucoLayout: which squares of a ChArUco board hold which markers, and which markers found in an
// image belong to the board. A marker counts if it and its neighbours predict each other's places;
// wrongly read markers do not.
// Before OpenCV 4.6 a board with an even number of rows had its colours, and so its markers, the
// other way round. The majority of neighbours in the images so far decides which layout it is.
// Before the decision no marker counts, as a part of a board may fit both layouts. One thread at a
// time.

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

// The image of a place under a homography.
[[nodiscard]] cv::Point2d mapped(const cv::Matx33d& H, const cv::Point2d& p);

class CharucoLayout {
 public:
  explicit CharucoLayout(const KnownPattern& pattern);

  // Places on the board are in squares from its first inner corner, x along the rows, y down.
  struct Marker {
    int id;
    cv::Matx33d image_from_board;  // OpenCV's pixels
    double square_px;              // smallest side about it
  };
  // The markers that count in this image (8-bit grey). None while is_undecided().
  [[nodiscard]] std::vector<Marker> markers_in(const cv::Mat& image);

  // The middle of each marker's square.
  [[nodiscard]] const std::vector<cv::Point2d>& middles() const { return middles_[chosen_]; }
  [[nodiscard]] bool is_black(int column, int row) const;  // of squares
  // Images so far in which at least three markers of the dictionary were found.
  [[nodiscard]] int images_with_markers() const { return images_with_markers_; }
  // Markers agree, but about equally well in both layouts.
  [[nodiscard]] bool is_undecided() const;
  // Another dictionary of which many markers were found, while no marker of the board's dictionary
  // was. Empty: none.
  [[nodiscard]] std::optional<int> other_dictionary() const { return other_dictionary_; }

 private:
  // Tries one dictionary at a time, in some of the images only, as it takes as long as the search
  // for the right one.
  void look_for_others(const cv::Mat& image);
  // 1: each lies where the other predicts it; -1: not; 0: too far apart to decide. Both
  // homographies start at the middle of their own square here.
  [[nodiscard]] int agreement(const Marker& a, const Marker& b, std::size_t layout) const;

  KnownPattern pattern_;
  std::array<std::vector<cv::Point2d>, 2> middles_;  // from OpenCV 4.6 on, and before
  std::array<int, 2> votes_ = {};
  std::size_t chosen_ = 0;
  int images_with_markers_ = 0;
  int images_without_ = 0;
  std::optional<int> other_dictionary_;
};

}  // namespace alidade::internal

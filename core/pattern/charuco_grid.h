#pragma once
// CharucoGrid: the inner corners of a ChArUco board in an image. One thread at a time.
//   1. Each marker (charuco_layout.h) predicts the corners of its square. Where markers are hidden,
//   the homography of the corners around predicts more.
//   2. The markers are painted over. What remains is a chessboard, whose corners are refined as
//   such, in windows larger than the white rim around a marker.
//   3. Corners are dropped whose image changes by half a turn (something lies on them), or that do
//   not lie where their neighbours predict.

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/pattern/charuco_layout.h"
#include "core/pattern/known_pattern.h"

namespace alidade::internal {

class CharucoGrid {
 public:
  explicit CharucoGrid(const KnownPattern& pattern);

  // image: 8-bit grey. Appends to *corners (OpenCV's pixels) and, for each corner, its index into
  // KnownPattern::points_m to *points. Appends nothing if the board is not found.
  void find(const cv::Mat& image, std::vector<cv::Point2f>* corners, std::vector<int>* points);

  // One line: why no image so far showed this board, and what would help. Empty if an image did.
  [[nodiscard]] std::string doubt() const;

 private:
  using Markers = std::vector<CharucoLayout::Marker>;
  struct Corner {
    bool is_found = false;
    cv::Point2f at;
    double contrast = 0;  // grey levels, white above black
  };

  void start(const Markers& markers);
  void grow();
  // The corner at the expected place, refined within the white rims of the markers. Not found if
  // there is none.
  [[nodiscard]] Corner settled(int point, const cv::Matx33d& image_from_board,
                               const cv::Point2d& expected) const;
  void finish(const cv::Mat& image, const Markers& markers);
  [[nodiscard]] cv::Mat painted(const cv::Mat& image, const Markers& markers) const;
  // From the square's corners, else its marker, else the corners around it. False if there is none
  // of these.
  [[nodiscard]] bool homography_of_square(int id, const Markers& markers,
                                          cv::Matx33d* image_from_board) const;
  void drop_misfits();

  // Found corners around a place except `without`, nearest first.
  [[nodiscard]] std::vector<int> corners_about(const cv::Point2d& place, int without) const;
  // From the corners around; robust: some may be wrong. False if there are too few.
  [[nodiscard]] bool homography_about(const cv::Point2d& place, int without, bool robust,
                                      cv::Matx33d* image_from_board) const;
  [[nodiscard]] cv::Point2d place_of(int point) const;
  // nullptr if no inner corner is there.
  [[nodiscard]] const Corner* corner_at(const cv::Point2d& place) const;

  KnownPattern pattern_;
  double half_marker_;  // squares
  CharucoLayout layout_;
  cv::Mat smooth_;  // the smoothed image
  int rim_window_px_ = 0;
  std::vector<Corner> corners_;  // by point
  int images_found_ = 0;
};

}  // namespace alidade::internal

#pragma once
// The inner corners of a ChArUco board in an image.
//   1. each of its markers (charuco_layout.h) tells where the corners of its square are; more corners, where markers hide, by the
//      homography of those around them
//   2. with the markers painted over, what remains is a chessboard: its corners are refined as a chessboard's, in windows larger than
//      the white rim about a marker
//   3. out goes what is unlike itself after half a turn (something lies on it), or not where its neighbours expect it
// One thread at a time.

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/pattern/charuco_layout.h"
#include "core/pattern/known_pattern.h"

namespace alidade::internal {

class CharucoGrid {
 public:
  explicit CharucoGrid(const KnownPattern& pattern);

  // 8-bit grey. corners: OpenCV's pixels; points: of each its index into KnownPattern::points_m. Both stay empty: not found.
  void find(const cv::Mat& image, std::vector<cv::Point2f>* corners, std::vector<int>* points);

  // One line, why the images so far never showed this board and what would help; empty: one did.
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
  // The corner expected there, refined within the white rims about the markers; not found if there is none.
  [[nodiscard]] Corner settled(int point, const cv::Matx33d& image_from_board,
                               const cv::Point2d& expected) const;
  void finish(const cv::Mat& image, const Markers& markers);
  [[nodiscard]] cv::Mat painted(const cv::Mat& image, const Markers& markers) const;
  // By its corners, else its marker, else what is found about it. False: by nothing.
  [[nodiscard]] bool homography_of_square(int id, const Markers& markers,
                                          cv::Matx33d* image_from_board) const;
  void drop_misfits();

  // Found corners next to a place, the nearest first, but for this point.
  [[nodiscard]] std::vector<int> corners_about(const cv::Point2d& place, int without) const;
  // By them; robust: some may be wrong. False: too few of them.
  [[nodiscard]] bool homography_about(const cv::Point2d& place, int without, bool robust,
                                      cv::Matx33d* image_from_board) const;
  [[nodiscard]] cv::Point2d place_of(int point) const;
  // nullptr: no inner corner is there.
  [[nodiscard]] const Corner* corner_at(const cv::Point2d& place) const;

  KnownPattern pattern_;
  double half_marker_;  // squares
  CharucoLayout layout_;
  cv::Mat smooth_;  // the image
  int rim_window_px_ = 0;
  std::vector<Corner> corners_;  // by point
  int images_found_ = 0;
};

}  // namespace alidade::internal

#pragma once
// The inner corners of a ChArUco board in an image.
//   1. markers by OpenCV; one counts if it and a neighbour lie where each lets expect the other, as wrong codes do not
//   2. each marker tells where the corners of its square are; more corners by the homography of those around them, where markers hide
//   3. with the markers painted over, what remains is a chessboard: its corners are refined as a chessboard's, in windows larger than
//      the white rim about a marker
//   4. out goes what is unlike itself after half a turn (something lies on it), or not where its neighbours expect it
// A board of an even number of rows had its colours, and so its markers, the other way round before OpenCV 4.6: what is seen in the
// images so far decides. One thread at a time.

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

class CharucoGrid {
 public:
  explicit CharucoGrid(const KnownPattern& pattern);

  // 8-bit grey. corners: OpenCV's pixels; points: of each its index into KnownPattern::points_m. Both stay empty: not found.
  void find(const cv::Mat& image, std::vector<cv::Point2f>* corners, std::vector<int>* points);

  // One line about markers in the images so far that never made this board, what would help; empty: nothing to say.
  [[nodiscard]] std::string doubt() const;

 private:
  // Places on the board are in squares, x along the rows, from its first inner corner.
  struct Marker {
    int id;
    cv::Matx33d image_from_board;
    double square_px;
  };
  struct Corner {
    bool is_found = false;
    cv::Point2f at;
    double contrast = 0;  // grey levels
  };

  [[nodiscard]] std::vector<Marker> markers_in(const cv::Mat& image);
  // 1: each lies where the other lets expect it, -1: not, 0: too far from each other to tell. Of one of the two layouts.
  [[nodiscard]] int agreement(const Marker& a, const Marker& b, std::size_t layout) const;
  void start(const std::vector<Marker>& markers);
  void grow();
  // The corner expected there, refined within the white rims about the markers; not found if there is none.
  [[nodiscard]] Corner settled(int point, const cv::Matx33d& image_from_board,
                               const cv::Point2d& expected) const;
  void finish(const cv::Mat& image, const std::vector<Marker>& markers);
  [[nodiscard]] cv::Mat painted(const cv::Mat& image, const std::vector<Marker>& markers) const;
  void drop_misfits();

  // Found corners next to a place, the nearest first, but for this point.
  [[nodiscard]] std::vector<int> corners_about(const cv::Point2d& place, int without) const;
  // By them; robust: some may be wrong. False: too few of them.
  [[nodiscard]] bool homography_about(const cv::Point2d& place, int without, bool robust,
                                      cv::Matx33d* image_from_board) const;
  [[nodiscard]] cv::Point2d place_of(int point) const;
  [[nodiscard]] bool is_black(int column, int row) const;  // of squares

  KnownPattern pattern_;
  double half_marker_;                              // squares
  std::array<std::vector<cv::Point2d>, 2> middles_;  // by id, of the squares with markers, in both layouts
  std::array<int, 2> votes_ = {};                   // of neighbours
  std::size_t layout_ = 0;
  cv::Mat smooth_;  // the image
  int rim_window_px_ = 0;
  std::vector<Corner> corners_;  // by point
  int images_with_markers_ = 0;
  int images_found_ = 0;
};

}  // namespace alidade::internal

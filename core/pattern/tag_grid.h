#pragma once
// TagGrid: the tags of an AprilGrid in an image. Tags may have a black border of one cell
// (libapriltag) or two (kalibr), with or without kalibr's black squares where gaps cross: the
// images decide. Squares touch the tags' corners, so that a tag's outline is no separate quad and
// libapriltag finds only some tags. The grid grows from these: the homography of the nearest known
// tags predicts a neighbour's corners; they are refined, and accepted if the neighbour's code is
// there. In a video the first guess is the tags of the previous images, extrapolated; this saves
// most searches. One thread at a time.

#include <array>
#include <cstddef>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/now_and_then.h"
#include "core/pattern/tag_corners.h"
#include "core/pattern/tag_spacing.h"

namespace alidade::internal {

class TagGrid {
 public:
  explicit TagGrid(const KnownPattern& pattern);
  ~TagGrid();
  TagGrid(const TagGrid&) = delete;
  TagGrid& operator=(const TagGrid&) = delete;

  // image: 8-bit grey. For each tag its four corners in the order of KnownPattern::points_m, in
  // OpenCV's pixels; empty: not found. A grid that differs from the pattern's name is not found.
  using Corners = std::vector<cv::Point2f>;
  [[nodiscard]] const std::vector<Corners>& find(const cv::Mat& image);

  // One line: how the grid in the images so far differs from the name; empty: not at all.
  [[nodiscard]] std::string doubt() const;

 private:
  struct Library;

  // For when the last image showed nothing: the next grid may be printed differently.
  void forget_layout();
  void search(const cv::Mat& image);
  // libapriltag's tags, those with the border that most of them have.
  [[nodiscard]] std::vector<NumberedTag> detected(const cv::Mat& image);
  // The same on an image in which tags and squares are separated; takes four times as long.
  [[nodiscard]] std::vector<NumberedTag> detected_apart(const cv::Mat& image);
  void follow(const cv::Mat& image);
  void grow(const cv::Mat& image);
  // A corner that slid along its square to another corner fits no neighbour. Refines it again from
  // its predicted place, else drops the tag.
  void repair(const cv::Mat& image);
  // From the neighbours; robust: some of their corners may be wrong. Empty: it has no neighbour.
  [[nodiscard]] Corners predicted(int tag, bool robust) const;
  // Refines the corners. False: the tag is not there.
  [[nodiscard]] bool confirm(const cv::Mat& image, int tag, Corners* corners);
  [[nodiscard]] double code_correlation(const cv::Mat& image, int tag,
                                        const Corners& corners) const;
  // Which of the tag's corners have squares printed next to them. The image decides what is not
  // known yet.
  [[nodiscard]] CornerSquares squares_of(int tag, const Corners& corners);

  KnownPattern pattern_;
  std::vector<cv::Point2f> points_;  // m
  std::unique_ptr<Library> library_;
  std::vector<TagFace> faces_;  // by tag
  cv::Mat smooth_;              // the smoothed image, for corners
  // Corners seen with a square minus those without: between tags, and on the grid's rim.
  std::array<int, 2> square_votes_ = {};
  TagSpacing spacing_;
  NowAndThen now_and_then_;
  std::vector<Corners> found_, before_, before_that_;
};

}  // namespace alidade::internal

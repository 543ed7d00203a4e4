#pragma once
// The tags of an AprilGrid in an image, with a black border of one cell, as libapriltag prints them, or two, as kalibr does, and with
// or without the black squares that kalibr prints where gaps cross: what is seen decides. Squares touch the tags' corners: a tag's
// outline is then no quad of its own, and libapriltag finds a part of the tags. The grid grows from these: corners of the neighbours
// are predicted by the homography of the nearest known tags, refined, and taken if the neighbour's code is really there. In a video
// the tags of the image before, moved on, are the first guess, which saves most searches. One thread at a time.

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

  // 8-bit grey. By tag, the four corners in the order of KnownPattern::points_m, OpenCV's pixels; empty: not found. A grid that
  // is another than the pattern says is not found.
  using Corners = std::vector<cv::Point2f>;
  [[nodiscard]] const std::vector<Corners>& find(const cv::Mat& image);

  // One line, in what the grid of the images so far is another; empty: nothing to say.
  [[nodiscard]] std::string doubt() const;

 private:
  struct Library;

  // In the last image nothing was found: whatever comes may be printed in another way.
  void forget_layout();
  void search(const cv::Mat& image);
  // libapriltag's tags, those with the border that most of them have.
  [[nodiscard]] std::vector<NumberedTag> detected(const cv::Mat& image);
  // The same once tags and squares no longer touch; takes four times as long.
  [[nodiscard]] std::vector<NumberedTag> detected_apart(const cv::Mat& image);
  void follow(const cv::Mat& image);
  void grow(const cv::Mat& image);
  // A corner that slid along its square to another one fits no neighbour: once more from where they expect it, else the tag goes.
  void repair(const cv::Mat& image);
  // By its neighbours; robust: some of their corners may be wrong. Empty: there is none beside it.
  [[nodiscard]] Corners predicted(int tag, bool robust) const;
  // Refines the corners and says whether the tag is there.
  [[nodiscard]] bool confirm(const cv::Mat& image, int tag, Corners* corners);
  [[nodiscard]] double code_correlation(const cv::Mat& image, int tag,
                                        const Corners& corners) const;
  // Beside which of the tag's corners squares are printed; what is not known yet, by what is seen there.
  [[nodiscard]] CornerSquares squares_of(int tag, const Corners& corners);

  KnownPattern pattern_;
  std::vector<cv::Point2f> points_;  // m
  std::unique_ptr<Library> library_;
  std::vector<TagFace> faces_;  // by tag
  cv::Mat smooth_;              // the image, for corners
  // Corners about which a square was seen less those without one: between tags, on the grid's rim.
  std::array<int, 2> square_votes_ = {};
  TagSpacing spacing_;
  NowAndThen now_and_then_;
  std::vector<Corners> found_, before_, before_that_;
};

}  // namespace alidade::internal

#pragma once
// The tags of an AprilGrid in an image. Where gaps cross, kalibr prints black squares that touch the tags' corners: a tag's outline
// is then no quad of its own, and libapriltag finds a part of the tags. The grid grows from these: corners of the neighbours are
// predicted by the homography of the nearest known tags, refined, and taken if the neighbour's code is really there. In a video
// the tags of the image before, moved on, are the first guess, which saves most searches. One thread at a time.

#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/tag_corners.h"

namespace alidade::internal {

class TagGrid {
 public:
  explicit TagGrid(const KnownPattern& pattern);
  ~TagGrid();
  TagGrid(const TagGrid&) = delete;
  TagGrid& operator=(const TagGrid&) = delete;

  // 8-bit grey. By tag, the four corners in the order of KnownPattern::points_m, OpenCV's pixels; empty: not found.
  using Corners = std::vector<cv::Point2f>;
  [[nodiscard]] const std::vector<Corners>& find(const cv::Mat& image);

 private:
  struct Library;

  void search(const cv::Mat& image);
  void follow(const cv::Mat& image);
  void grow(const cv::Mat& image);
  // A corner that slid along its square to another one fits no neighbour: once more from where they expect it, else the tag goes.
  void repair(const cv::Mat& image);
  // By its neighbours; robust: some of their corners may be wrong. Empty: there is none beside it.
  [[nodiscard]] Corners predicted(int tag, bool robust) const;
  // Refines the corners and says whether the tag is there.
  [[nodiscard]] bool confirm(const cv::Mat& image, int tag, Corners* corners) const;
  [[nodiscard]] double code_correlation(const cv::Mat& image, int tag,
                                        const Corners& corners) const;

  KnownPattern pattern_;
  std::vector<cv::Point2f> points_;  // m
  std::unique_ptr<Library> library_;
  std::vector<TagCells> cells_;  // by tag
  cv::Mat smooth_;               // the image, for corners
  std::vector<Corners> found_, before_, before_that_;
};

}  // namespace alidade::internal

#include "core/pattern/tag_grid.h"

#include <apriltag.h>
#include <tag36h11.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace alidade::internal {
namespace {

// Of 36 bits two codes of the family differ in 11: another tag's correlation is at most 1 - 22 / 36.
constexpr double kLeastCorrelation = 0.6;
constexpr double kLeastTagContrast = 5;  // grey levels, standard deviation over the bits
constexpr double kWindow_cells = 0.9;
// Gradients by differences are wrong where edges are sharper than pixels; more would mix the code's cells in.
constexpr double kSmoothing_px = 0.5;
constexpr int kLeastTagWindow_px = 2;
constexpr int kLargestTagWindow_px = 11;
constexpr double kLargestChange_cells = 0.7;  // of a corner by its refinement
// How far a lens bends what the neighbours expect.
constexpr double kFits_px = 1;
constexpr double kFits_cells = 0.3;
constexpr std::size_t kNeighbours = 4;  // whose homography predicts a tag

double shortest_side(const TagGrid::Corners& corners) {
  double shortest = 1e9;
  for (std::size_t i = 0; i < 4; ++i)
    shortest = std::min(shortest, cv::norm(corners[(i + 1) % 4] - corners[i]));
  return shortest;
}

TagCells cells_of(const apriltag_family_t& family, int tag) {
  TagCells cells{};
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    cells[family.bit_y[i]][family.bit_x[i]] =
        ((family.codes[tag] >> (family.nbits - 1 - i)) & 1U) != 0;
  }
  return cells;
}

}  // namespace

struct TagGrid::Library {
  struct DetectorEnd {
    void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
  };
  struct FamilyEnd {
    void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
  };
  std::unique_ptr<apriltag_family_t, FamilyEnd> family{tag36h11_create()};
  std::unique_ptr<apriltag_detector_t, DetectorEnd> detector{apriltag_detector_create()};
};

TagGrid::TagGrid(const KnownPattern& pattern)
    : pattern_(pattern), library_(std::make_unique<Library>()) {
  for (const Vector3<double>& p : pattern.points_m())
    points_.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  apriltag_detector_t* detector = library_->detector.get();
  detector->quad_decimate = 1;
  // Less is noise, which costs most of the time.
  detector->qtp.min_white_black_diff = 20;
  apriltag_detector_add_family(detector, library_->family.get());
  for (int tag = 0; tag < pattern_.columns * pattern_.rows; ++tag)
    cells_.push_back(cells_of(*library_->family, tag));
}

TagGrid::~TagGrid() = default;

const std::vector<TagGrid::Corners>& TagGrid::find(const cv::Mat& image) {
  cv::GaussianBlur(image, smooth_, {0, 0}, kSmoothing_px);

  before_that_ = std::exchange(before_, std::exchange(found_, {}));
  const auto tags = static_cast<std::size_t>(pattern_.columns * pattern_.rows);
  found_.resize(tags);
  before_.resize(tags);
  before_that_.resize(tags);
  follow(image);
  const auto count = [](const std::vector<Corners>& all) {
    return std::count_if(all.begin(), all.end(), [](const Corners& c) { return !c.empty(); });
  };
  if (count(found_) == 0 || 3 * count(found_) < count(before_)) search(image);
  grow(image);
  repair(image);
  return found_;
}

void TagGrid::follow(const cv::Mat& image) {
  for (std::size_t tag = 0; tag < found_.size(); ++tag) {
    if (before_[tag].empty()) continue;
    Corners corners = before_[tag];
    for (std::size_t i = 0; i < 4 && !before_that_[tag].empty(); ++i)
      corners[i] += before_[tag][i] - before_that_[tag][i];
    if (confirm(image, static_cast<int>(tag), &corners)) found_[tag] = corners;
  }
}

void TagGrid::search(const cv::Mat& image) {
  image_u8_t view = {image.cols, image.rows, static_cast<int32_t>(image.step), image.data};
  zarray_t* all = apriltag_detector_detect(library_->detector.get(), &view);
  for (int i = 0; i < zarray_size(all); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(all, i, static_cast<void*>(&detection));
    if (detection->id >= pattern_.columns * pattern_.rows || detection->hamming > 1) continue;
    Corners corners;
    for (const auto& p : detection->p) {
      // libapriltag's image spans [0, w] x [0, h]; OpenCV's begins at the first pixel's centre.
      corners.emplace_back(static_cast<float>(p[0] - 0.5), static_cast<float>(p[1] - 0.5));
    }
    if (confirm(image, detection->id, &corners))
      found_[static_cast<std::size_t>(detection->id)] = corners;
  }
  apriltag_detections_destroy(all);
}

TagGrid::Corners TagGrid::predicted(int tag, bool robust) const {
  const int column = tag % pattern_.columns;
  const int row = tag / pattern_.columns;
  std::vector<std::pair<int, int>> near;  // squared distance, tag
  for (int r = std::max(0, row - 2); r <= std::min(pattern_.rows - 1, row + 2); ++r) {
    for (int c = std::max(0, column - 2); c <= std::min(pattern_.columns - 1, column + 2); ++c) {
      const int other = r * pattern_.columns + c;
      if (other == tag || found_[static_cast<std::size_t>(other)].empty()) continue;
      near.emplace_back((r - row) * (r - row) + (c - column) * (c - column), other);
    }
  }
  std::sort(near.begin(), near.end());
  if (near.empty() || near.front().first > 2) return {};
  if (near.size() > kNeighbours) near.resize(kNeighbours);
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  for (const auto& [distance, other] : near) {
    for (std::size_t i = 0; i < 4; ++i) {
      from.push_back(points_[static_cast<std::size_t>(4 * other) + i]);
      to.push_back(found_[static_cast<std::size_t>(other)][i]);
    }
  }
  const cv::Mat H = cv::findHomography(from, to, robust ? cv::RANSAC : 0, kFits_px);
  if (H.empty()) return {};
  const auto first = points_.begin() + 4 * tag;
  Corners corners;
  cv::perspectiveTransform(Corners(first, first + 4), corners, H);
  return corners;
}

void TagGrid::grow(const cv::Mat& image) {
  // A tag that was not there may be once more of its neighbours tell where.
  constexpr int kRounds = 12;
  bool grown = true;
  for (int round = 0; grown && round < kRounds; ++round) {
    grown = false;
    for (std::size_t tag = 0; tag < found_.size(); ++tag) {
      if (!found_[tag].empty()) continue;
      Corners corners = predicted(static_cast<int>(tag), false);
      if (corners.empty() || !confirm(image, static_cast<int>(tag), &corners)) continue;
      found_[tag] = corners;
      grown = true;
    }
  }
}

void TagGrid::repair(const cv::Mat& image) {
  const auto off = [](const Corners& a, const Corners& b) {
    double most = 0;
    for (std::size_t i = 0; i < 4; ++i) most = std::max(most, cv::norm(a[i] - b[i]));
    return most;
  };
  for (std::size_t tag = 0; tag < found_.size(); ++tag) {
    if (found_[tag].empty()) continue;
    const auto number = static_cast<int>(tag);
    Corners expected = predicted(number, false);
    if (expected.empty() || off(expected, found_[tag]) < kFits_px) continue;
    expected = predicted(number, true);
    if (expected.empty()) continue;
    const double limit = std::max(kFits_px, kFits_cells * shortest_side(expected) / kTagCells);
    if (off(expected, found_[tag]) < limit) continue;
    Corners corners = expected;
    if (confirm(image, number, &corners) && off(expected, corners) < limit) {
      found_[tag] = corners;
    } else {
      found_[tag].clear();
    }
  }
}

bool TagGrid::confirm(const cv::Mat& image, int tag, Corners* corners) const {
  const double cell = shortest_side(*corners) / kTagCells;
  const double room = std::min(1.0, pattern_.gap * kTagCells) * cell;
  const int half =
      std::clamp(static_cast<int>(kWindow_cells * room), kLeastTagWindow_px, kLargestTagWindow_px);
  const cv::Rect2f inner(static_cast<float>(half + 1), static_cast<float>(half + 1),
                         static_cast<float>(image.cols - 2 * half - 2),
                         static_cast<float>(image.rows - 2 * half - 2));
  if (!std::all_of(corners->begin(), corners->end(),
                   [&](const cv::Point2f& c) { return inner.contains(c); }))
    return false;
  const Corners start = *corners;
  cv::cornerSubPix(smooth_, *corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.001});
  for (std::size_t i = 0; i < 4; ++i) {
    if (!(cv::norm((*corners)[i] - start[i]) <= std::max(1.0, kLargestChange_cells * cell)))
      return false;
  }
  return code_correlation(image, tag, *corners) >= kLeastCorrelation &&
         refine_tag_corners(smooth_, cells_[static_cast<std::size_t>(tag)],
                            pattern_.gap * kTagCells, corners);
}

double TagGrid::code_correlation(const cv::Mat& image, int tag, const Corners& corners) const {
  const apriltag_family_t& family = *library_->family;
  const TagCells& cells = cells_[static_cast<std::size_t>(tag)];
  const cv::Matx33d H = cv::getPerspectiveTransform(tag_square(), corners);
  const auto bits = static_cast<int>(family.nbits);
  double sum = 0;
  double squares = 0;
  double white_sum = 0;
  int white = 0;
  for (int i = 0; i < bits; ++i) {
    const cv::Vec3d p = H * cv::Vec3d(family.bit_x[i] + 0.5, family.bit_y[i] + 0.5, 1);
    const auto u = static_cast<int>(std::lround(p[0] / p[2]));
    const auto v = static_cast<int>(std::lround(p[1] / p[2]));
    if (u < 0 || v < 0 || u >= image.cols || v >= image.rows) return 0;
    const double grey = image.at<std::uint8_t>(v, u);
    sum += grey;
    squares += grey * grey;
    if (cells[family.bit_y[i]][family.bit_x[i]]) {
      white_sum += grey;
      ++white;
    }
  }
  const double mean = sum / bits;
  const double variance = squares / bits - mean * mean;
  if (!(variance > kLeastTagContrast * kLeastTagContrast)) return 0;
  const double part = static_cast<double>(white) / bits;
  return (white_sum / bits - part * mean) / std::sqrt(variance * part * (1 - part));
}

}  // namespace alidade::internal

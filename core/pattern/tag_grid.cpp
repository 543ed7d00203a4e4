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

// Two codes of the family differ in at least 11 of 36 bits: another tag's correlation is at most
// 1 - 22 / 36.
constexpr double kLeastCorrelation = 0.6;
constexpr double kLeastTagContrast = 5;  // grey levels, standard deviation over the bits
// A window that holds a second corner, of a square or of the code, pulls towards it.
constexpr double kWindowInBorder = 0.9;
constexpr double kWindowInGap = 0.6;
// Gradients by differences are wrong at edges sharper than a pixel. More smoothing would mix in the
// code's cells.
constexpr double kSmoothing_px = 0.5;
constexpr int kLeastTagWindow_px = 2;
constexpr int kLargestTagWindow_px = 11;
constexpr double kLargestChange = 0.09;  // of a corner by its refinement, as a share of a side
// How far a lens bends the neighbours' prediction.
constexpr double kFits_px = 1;
constexpr double kFits = 0.04;          // share of a side
constexpr std::size_t kNeighbours = 4;  // whose homography predicts a tag
constexpr float kEnlarged = 2;          // white then grows by a pixel: it parts tags from squares
constexpr int kBorders = 2;             // border widths to look for: one cell, two cells
constexpr int kMostWrongBits = 1;       // in a code
// Lead of corners with a square over those without, or the reverse, beyond which the layout is
// known.
constexpr int kSureOfSquares = 12;
constexpr double kLeastEvidence = 0.05;

double shortest_side(const TagGrid::Corners& corners) {
  double shortest = 1e9;
  for (std::size_t i = 0; i < 4; ++i)
    shortest = std::min(shortest, cv::norm(corners[(i + 1) % 4] - corners[i]));
  return shortest;
}

// The place of a code's first cell in tag36h11_create(), in cells of the tag.
constexpr std::uint32_t kFamilyBorder = 1;

TagFace face_of(const apriltag_family_t& family, int tag) {
  TagFace face;
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    face.is_white.at(family.bit_y[i] - kFamilyBorder).at(family.bit_x[i] - kFamilyBorder) =
        ((family.codes[tag] >> (family.nbits - 1 - i)) & 1U) != 0;
  }
  return face;
}

// Least contrast of a tag's edges in this image, grey levels. Lower is noise, which costs most of
// the time.
int least_contrast(const cv::Mat& image) {
  constexpr int kUsual = 20;
  constexpr int kLeast = 6;
  constexpr double kOfRange = 0.3;
  constexpr double kBeyond = 0.002;  // share of the pixels that may be glints
  std::array<int, 256> counts{};
  std::for_each(image.begin<std::uint8_t>(), image.end<std::uint8_t>(),
                [&](std::uint8_t grey) { ++counts[grey]; });
  const auto few = static_cast<int>(kBeyond * static_cast<double>(image.total()));
  int low = 0;
  for (int below = 0; low < 255 && (below += counts[static_cast<std::size_t>(low)]) <= few;) ++low;
  int high = 255;
  for (int above = 0; high > 0 && (above += counts[static_cast<std::size_t>(high)]) <= few;) --high;
  return std::clamp(static_cast<int>(kOfRange * (high - low)), kLeast, kUsual);
}

bool is_found(const TagGrid::Corners& corners) { return !corners.empty(); }

std::ptrdiff_t count_of(const std::vector<TagGrid::Corners>& all) {
  return std::count_if(all.begin(), all.end(), is_found);
}

}  // namespace

struct TagGrid::Library {
  struct DetectorEnd {
    void operator()(apriltag_detector_t* ended) const { apriltag_detector_destroy(ended); }
  };
  struct FamilyEnd {
    void operator()(apriltag_family_t* ended) const { tag36h11_destroy(ended); }
  };
  // By border - 1.
  std::array<std::unique_ptr<apriltag_family_t, FamilyEnd>, kBorders> families;
  std::unique_ptr<apriltag_detector_t, DetectorEnd> detector{apriltag_detector_create()};
};

TagGrid::TagGrid(const KnownPattern& pattern)
    : pattern_(pattern), library_(std::make_unique<Library>()), spacing_(pattern) {
  for (const Vector3<double>& p : pattern.points_m())
    points_.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  apriltag_detector_t* detector = library_->detector.get();
  detector->quad_decimate = 1;
  int wider = 0;
  for (auto& family : library_->families) {
    family.reset(tag36h11_create());
    family->width_at_border += 2 * wider;
    family->total_width += 2 * wider;
    for (std::uint32_t i = 0; i < family->nbits; ++i) {
      family->bit_x[i] += static_cast<std::uint32_t>(wider);
      family->bit_y[i] += static_cast<std::uint32_t>(wider);
    }
    apriltag_detector_add_family_bits(detector, family.get(), kMostWrongBits);
    ++wider;
  }
  for (int tag = 0; tag < pattern_.columns * pattern_.rows; ++tag)
    faces_.push_back(face_of(*library_->families[0], tag));
}

TagGrid::~TagGrid() = default;

std::string TagGrid::doubt() const { return spacing_.doubt(); }

const std::vector<TagGrid::Corners>& TagGrid::find(const cv::Mat& image) {
  cv::GaussianBlur(image, smooth_, {0, 0}, kSmoothing_px);
  const std::size_t tags = faces_.size();
  before_that_ = std::move(before_);
  before_ = std::move(found_);
  found_.assign(tags, {});
  before_.resize(tags);
  before_that_.resize(tags);
  follow(image);
  if (count_of(before_) == 0) forget_layout();
  if (count_of(found_) == 0 || 3 * count_of(found_) < count_of(before_)) search(image);
  grow(image);
  repair(image);
  std::vector<NumberedTag> seen;
  for (std::size_t tag = 0; tag < tags; ++tag) {
    if (is_found(found_[tag])) seen.push_back({static_cast<int>(tag), found_[tag]});
  }
  spacing_.add(seen, false);
  if (!doubt().empty()) found_.assign(tags, {});
  return found_;
}

void TagGrid::forget_layout() { square_votes_ = {}; }

void TagGrid::follow(const cv::Mat& image) {
  for (std::size_t tag = 0; tag < found_.size(); ++tag) {
    if (before_[tag].empty()) continue;
    Corners corners = before_[tag];
    for (std::size_t i = 0; i < 4 && !before_that_[tag].empty(); ++i)
      corners[i] += before_[tag][i] - before_that_[tag][i];
    if (confirm(image, static_cast<int>(tag), &corners)) found_[tag] = corners;
  }
}

std::vector<NumberedTag> TagGrid::detected(const cv::Mat& image) {
  library_->detector->qtp.min_white_black_diff = least_contrast(image);
  image_u8_t view = {image.cols, image.rows, static_cast<int32_t>(image.step), image.data};
  std::array<std::vector<NumberedTag>, kBorders> by_border;
  zarray_t* all = apriltag_detector_detect(library_->detector.get(), &view);
  for (int i = 0; i < zarray_size(all); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(all, i, static_cast<void*>(&detection));
    NumberedTag tag{detection->id, {}};
    for (const auto& p : detection->p) {
      // libapriltag's image spans [0, w] x [0, h]; OpenCV's begins at the first pixel's centre.
      tag.corners.emplace_back(static_cast<float>(p[0] - 0.5), static_cast<float>(p[1] - 0.5));
    }
    for (std::size_t border = 0; border < kBorders; ++border) {
      if (detection->family == library_->families[border].get()) by_border[border].push_back(tag);
    }
  }
  apriltag_detections_destroy(all);
  const std::size_t border = by_border[1].size() > by_border[0].size() ? 1 : 0;
  if (!by_border[border].empty()) {
    for (TagFace& face : faces_) face.border = static_cast<int>(border) + 1;
  }
  return by_border[border];
}

void TagGrid::search(const cv::Mat& image) {
  std::vector<NumberedTag> tags = detected(image);
  if (tags.empty()) {
    now_and_then_([&] {
      tags = detected_apart(image);
      return !tags.empty();
    });
  }
  spacing_.add(tags, true);
  for (const NumberedTag& tag : tags) {
    if (tag.id >= static_cast<int>(faces_.size())) continue;
    Corners corners = tag.corners;
    if (confirm(image, tag.id, &corners)) found_[static_cast<std::size_t>(tag.id)] = corners;
  }
}

std::vector<NumberedTag> TagGrid::detected_apart(const cv::Mat& image) {
  cv::Mat larger;
  cv::resize(image, larger, {}, kEnlarged, kEnlarged, cv::INTER_CUBIC);
  cv::dilate(larger, larger, cv::Mat());
  std::vector<NumberedTag> tags = detected(larger);
  for (NumberedTag& tag : tags) {
    for (cv::Point2f& corner : tag.corners) {
      corner = (corner + cv::Point2f(0.5F, 0.5F)) / kEnlarged - cv::Point2f(0.5F, 0.5F);
    }
  }
  return tags;
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
  // A tag that was not found may be, once more neighbours predict it.
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
    const double limit = std::max(kFits_px, kFits * shortest_side(expected));
    if (off(expected, found_[tag]) < limit) continue;
    Corners corners = expected;
    if (confirm(image, number, &corners) && off(expected, corners) < limit) {
      found_[tag] = corners;
    } else {
      found_[tag].clear();
    }
  }
}

bool TagGrid::confirm(const cv::Mat& image, int tag, Corners* corners) {
  const TagFace& face = faces_[static_cast<std::size_t>(tag)];
  const double side = shortest_side(*corners);
  const double room =
      side * std::min(kWindowInBorder * face.border / face.side(), kWindowInGap * spacing_.gap());
  const int half = std::clamp(static_cast<int>(room), kLeastTagWindow_px, kLargestTagWindow_px);
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
    if (!(cv::norm((*corners)[i] - start[i]) <= std::max(1.0, kLargestChange * side))) return false;
  }
  return code_correlation(image, tag, *corners) >= kLeastCorrelation &&
         refine_tag_corners(smooth_, face, squares_of(tag, *corners), spacing_.gap(), corners);
}

CornerSquares TagGrid::squares_of(int tag, const Corners& corners) {
  const int column = tag % pattern_.columns;
  const int row = tag / pattern_.columns;
  const bool left = column == 0;
  const bool right = column == pattern_.columns - 1;
  const bool bottom = row == 0;
  const bool top = row == pattern_.rows - 1;
  const std::array<bool, 4> on_rim = {left || bottom, right || bottom, right || top, left || top};
  std::array<double, 4> evidence{};
  bool is_seen = false;
  CornerSquares squares{};
  for (std::size_t i = 0; i < 4; ++i) {
    int& votes = square_votes_[on_rim[i] ? 1 : 0];
    if (std::abs(votes) >= kSureOfSquares) {
      squares[i] = votes > 0;
      continue;
    }
    if (!is_seen) {
      evidence = evidence_of_squares(smooth_, faces_[static_cast<std::size_t>(tag)], spacing_.gap(),
                                     corners);
      is_seen = true;
    }
    squares[i] = evidence[i] > 0;
    if (std::abs(evidence[i]) >= kLeastEvidence) votes += evidence[i] > 0 ? 1 : -1;
  }
  return squares;
}

double TagGrid::code_correlation(const cv::Mat& image, int tag, const Corners& corners) const {
  const TagFace& face = faces_[static_cast<std::size_t>(tag)];
  const cv::Matx33d H = cv::getPerspectiveTransform(tag_square(face.side()), corners);
  double sum = 0;
  double squares = 0;
  double white_sum = 0;
  int white = 0;
  for (int i = 0; i < kCodeCells * kCodeCells; ++i) {
    const int row = i / kCodeCells;
    const int column = i % kCodeCells;
    const cv::Vec3d p = H * cv::Vec3d(face.border + column + 0.5, face.border + row + 0.5, 1);
    const auto u = static_cast<int>(std::lround(p[0] / p[2]));
    const auto v = static_cast<int>(std::lround(p[1] / p[2]));
    if (u < 0 || v < 0 || u >= image.cols || v >= image.rows) return 0;
    const double grey = image.at<std::uint8_t>(v, u);
    sum += grey;
    squares += grey * grey;
    if (face.is_white[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)]) {
      white_sum += grey;
      ++white;
    }
  }
  constexpr int kBits = kCodeCells * kCodeCells;
  const double mean = sum / kBits;
  const double variance = squares / kBits - mean * mean;
  if (!(variance > kLeastTagContrast * kLeastTagContrast)) return 0;
  const double part = static_cast<double>(white) / kBits;
  return (white_sum / kBits - part * mean) / std::sqrt(variance * part * (1 - part));
}

}  // namespace alidade::internal

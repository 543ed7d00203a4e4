#include "core/pattern/charuco_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "core/model/median.h"
#include "core/pattern/corner_refinement.h"

namespace alidade::internal {
namespace {

constexpr double kCharucoSmoothing_px = 0.7;
constexpr double kRimWindow = 0.9;  // of the rim
constexpr int kLeastRimWindow_px = 2;
constexpr int kLargestRimWindow_px = 8;
constexpr double kLeastCornerContrast = 8;   // grey levels, white above black
constexpr double kLeastContrastShare = 0.4;  // of the median of the image's corners
// Distances from a corner at which the brightness of its squares is sampled.
constexpr double kBlack_squares = 0.25;
constexpr double kWhite_rims = 0.6;
constexpr std::size_t kCornerNeighbours = 8;  // whose homography predicts a corner
constexpr std::size_t kFewestCorners = 4;     // needed for a board
constexpr double kLargestAsymmetry = 0.2;     // share of the standard deviation
constexpr double kSettled_px = 1;             // of a corner's step; then the paint stays the same
// How far a lens bends the prediction from neighbours on one side of a corner.
constexpr double kCornerFits_px = 1;
constexpr double kCornerFits_squares = 0.08;
// Share of the samples along the middle of a white rim that the paint's brightness exceeds: sides
// that blur and noise leave bright.
constexpr double kWhiteShare = 0.9;

// A square's corners from its middle, in squares.
const std::vector<cv::Point2f>& square_corners() {
  static const std::vector<cv::Point2f> corners = {
      {-0.5F, -0.5F}, {0.5F, -0.5F}, {0.5F, 0.5F}, {-0.5F, 0.5F}};
  return corners;
}

// Grey level of the nearest pixel; black outside.
double grey_at(const cv::Mat& image, const cv::Point2d& p) {
  if (!(p.x >= 0 && p.y >= 0 && p.x < image.cols - 1 && p.y < image.rows - 1)) return 0;
  return image.at<std::uint8_t>(static_cast<int>(std::lround(p.y)),
                                static_cast<int>(std::lround(p.x)));
}

bool has_room(const cv::Mat& image, const cv::Point2f& p, int half) {
  const auto edge = static_cast<float>(half + 1);
  return p.x >= edge && p.y >= edge && p.x < static_cast<float>(image.cols) - edge - 1 &&
         p.y < static_cast<float>(image.rows) - edge - 1;
}

// How much a patch differs from itself after half a turn: mean difference over standard deviation.
double asymmetry(const cv::Mat& image, const cv::Point2f& corner, int half) {
  cv::Mat patch;
  cv::getRectSubPix(image, {2 * half + 1, 2 * half + 1}, corner, patch);
  cv::Mat turned;
  cv::flip(patch, turned, -1);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(patch, mean, deviation);
  return cv::norm(patch, turned, cv::NORM_L1) /
         (static_cast<double>(patch.total()) * std::max(1.0, deviation[0]));
}

}  // namespace

CharucoGrid::CharucoGrid(const KnownPattern& pattern)
    : pattern_(pattern), half_marker_(0.5 * pattern.marker_m / pattern.size_m), layout_(pattern) {}

void CharucoGrid::find(const cv::Mat& image, std::vector<cv::Point2f>* corners,
                       std::vector<int>* points) {
  corners_.assign(static_cast<std::size_t>((pattern_.columns - 1) * (pattern_.rows - 1)), {});
  const Markers markers = layout_.markers_in(image);
  if (markers.empty()) return;
  cv::GaussianBlur(image, smooth_, {0, 0}, kCharucoSmoothing_px);
  start(markers);
  grow();
  finish(image, markers);
  drop_misfits();
  const auto found = std::count_if(corners_.begin(), corners_.end(),
                                   [](const Corner& corner) { return corner.is_found; });
  if (static_cast<std::size_t>(found) < kFewestCorners) return;
  ++images_found_;
  for (std::size_t point = 0; point < corners_.size(); ++point) {
    if (!corners_[point].is_found) continue;
    corners->push_back(corners_[point].at);
    points->push_back(static_cast<int>(point));
  }
}

std::string CharucoGrid::doubt() const {
  if (images_found_ > 0) return "";
  const auto name = [](int dictionary) {
    return std::string(kMarkerDictionaries[static_cast<std::size_t>(dictionary)].name);
  };
  const std::string mine = name(pattern_.dictionary);
  if (layout_.is_undecided()) {
    return "the visible part of the board fits boards of OpenCV before 4.6 and later ones; show "
           "the whole "
           "board once";
  }
  if (layout_.images_with_markers() > 0) {
    return "markers of dictionary " + mine + " are seen in " +
           std::to_string(layout_.images_with_markers()) +
           " images, but not where this board has them; check its counts (they count squares) and "
           "the sides of its squares and markers";
  }
  if (const std::optional<int> other = layout_.other_dictionary()) {
    return "markers of dictionary " + name(*other) + " are seen, but none of " + mine +
           "; what is the board's dictionary? An AprilGrid also has markers, of apriltag_36h11";
  }
  return "no markers of dictionary " + mine + " are seen in any image";
}

void CharucoGrid::start(const Markers& markers) {
  double square_px = std::numeric_limits<double>::max();
  for (const CharucoLayout::Marker& marker : markers)
    square_px = std::min(square_px, marker.square_px);
  rim_window_px_ = std::clamp(static_cast<int>(kRimWindow * (0.5 - half_marker_) * square_px),
                              kLeastRimWindow_px, kLargestRimWindow_px);
  // Means of the predictions by the markers on both sides of a corner.
  struct Expected {
    cv::Point2d sum;
    int markers = 0;
    cv::Matx33d image_from_board;
  };
  std::map<int, Expected> expected;
  for (const CharucoLayout::Marker& marker : markers) {
    const cv::Point2d middle = layout_.middles()[static_cast<std::size_t>(marker.id)];
    for (const cv::Point2f& corner : square_corners()) {
      const cv::Point2d place = middle + cv::Point2d(corner);
      const Corner* inner = corner_at(place);
      if (inner == nullptr) continue;
      Expected& e = expected[static_cast<int>(inner - corners_.data())];
      e.sum += mapped(marker.image_from_board, place);
      e.markers += 1;
      e.image_from_board = marker.image_from_board;
    }
  }
  std::vector<double> contrasts;
  for (const auto& [point, e] : expected) {
    Corner& corner = corners_[static_cast<std::size_t>(point)];
    corner = settled(point, e.image_from_board, e.sum / e.markers);
    if (corner.is_found) contrasts.push_back(corner.contrast);
  }
  if (contrasts.empty()) return;
  const double least = kLeastContrastShare * median(std::move(contrasts));
  for (Corner& corner : corners_) corner.is_found = corner.is_found && corner.contrast >= least;
}

void CharucoGrid::grow() {
  constexpr int kRounds = 12;
  bool grown = true;
  for (int round = 0; grown && round < kRounds; ++round) {
    grown = false;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i].is_found) continue;
      const auto point = static_cast<int>(i);
      const cv::Point2d place = place_of(point);
      cv::Matx33d H;
      if (!homography_about(place, point, false, &H)) continue;
      const std::vector<int> about = corners_about(place, point);
      const Corner corner = settled(point, H, mapped(H, place));
      double contrast = 0;
      for (const int other : about) contrast += corners_[static_cast<std::size_t>(other)].contrast;
      if (!corner.is_found ||
          corner.contrast < kLeastContrastShare * contrast / static_cast<double>(about.size()))
        continue;
      corners_[i] = corner;
      grown = true;
    }
  }
}

CharucoGrid::Corner CharucoGrid::settled(int point, const cv::Matx33d& image_from_board,
                                         const cv::Point2d& expected) const {
  Corner corner;
  corner.at = expected;
  if (!has_room(smooth_, corner.at, rim_window_px_)) return corner;
  std::vector<cv::Point2f> refined = {corner.at};
  cv::cornerSubPix(smooth_, refined, {rim_window_px_, rim_window_px_}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.01});
  corner.at = refined.front();

  const cv::Point2d place = place_of(point);
  const cv::Point2d origin = mapped(image_from_board, place);
  double white = 255;
  double black = 0;
  for (const int right : {0, 1}) {
    for (const int below : {0, 1}) {
      const bool dark = layout_.is_black(point % (pattern_.columns - 1) + right,
                                         point / (pattern_.columns - 1) + below);
      const double reach = dark ? kBlack_squares : kWhite_rims * (0.5 - half_marker_);
      const cv::Point2d step(reach * (2 * right - 1), reach * (2 * below - 1));
      const double grey = grey_at(
          smooth_, cv::Point2d(corner.at) + mapped(image_from_board, place + step) - origin);
      if (dark) {
        black = std::max(black, grey);
      } else {
        white = std::min(white, grey);
      }
    }
  }
  corner.contrast = white - black;
  corner.is_found = corner.contrast >= kLeastCornerContrast;
  return corner;
}

bool CharucoGrid::homography_of_square(int id, const Markers& markers,
                                       cv::Matx33d* image_from_board) const {
  const cv::Point2d middle = layout_.middles()[static_cast<std::size_t>(id)];
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  for (const cv::Point2f& corner : square_corners()) {
    const cv::Point2d place = middle + cv::Point2d(corner);
    const Corner* inner = corner_at(place);
    if (inner == nullptr || !inner->is_found) continue;
    from.emplace_back(place);
    to.push_back(inner->at);
  }
  if (from.size() == square_corners().size()) {
    *image_from_board = cv::getPerspectiveTransform(from, to);
    return true;
  }
  const auto marker =
      std::find_if(markers.begin(), markers.end(), [&](const auto& m) { return m.id == id; });
  if (marker == markers.end()) return homography_about(middle, -1, false, image_from_board);
  *image_from_board = marker->image_from_board;
  return true;
}

cv::Mat CharucoGrid::painted(const cv::Mat& image, const Markers& markers) const {
  constexpr int kShift = 4;  // sixteenths of a pixel
  constexpr int kSteps = 8;  // along a side
  cv::Mat clean = image.clone();
  for (std::size_t id = 0; id < layout_.middles().size(); ++id) {
    cv::Matx33d H;
    if (!homography_of_square(static_cast<int>(id), markers, &H)) continue;
    const cv::Point2d middle = layout_.middles()[id];
    std::vector<cv::Point2d> outline;  // through the middle of the white rim
    for (const cv::Point2f& corner : square_corners())
      outline.emplace_back(middle + (half_marker_ + 0.5) * cv::Point2d(corner));
    std::vector<cv::Point> polygon;
    std::vector<double> greys;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const cv::Point2d side = outline[(i + 1) % outline.size()] - outline[i];
      polygon.emplace_back(mapped(H, outline[i]) * (1 << kShift));
      for (int step = 0; step < kSteps; ++step)
        greys.push_back(grey_at(image, mapped(H, outline[i] + side * step / kSteps)));
    }
    const auto white = greys.begin() +
                       static_cast<std::ptrdiff_t>(kWhiteShare * static_cast<double>(greys.size()));
    std::nth_element(greys.begin(), white, greys.end());
    cv::fillConvexPoly(clean, polygon, cv::Scalar(*white), cv::LINE_8, kShift);
  }
  return clean;
}

void CharucoGrid::finish(const cv::Mat& image, const Markers& markers) {
  constexpr int kPasses = 3;  // blur makes the corners err by more than the painted area allows
  bool is_settled = false;
  for (int pass = 0; pass < kPasses && !is_settled; ++pass) {
    const cv::Mat clean = painted(image, markers);
    std::vector<Corner*> found;
    std::vector<cv::Point2f> refined;
    for (Corner& corner : corners_) {
      if (!corner.is_found) continue;
      found.push_back(&corner);
      refined.push_back(corner.at);
    }
    if (refined.size() < kFewestCorners) return;
    const int half = corner_window(refined);
    refine_corners(clean, &refined);
    is_settled = true;
    for (std::size_t i = 0; i < found.size(); ++i) {
      is_settled = is_settled && cv::norm(refined[i] - found[i]->at) <= kSettled_px;
      found[i]->is_found = has_room(clean, refined[i], half);
      found[i]->at = refined[i];
    }
    if (!is_settled && pass + 1 < kPasses) continue;
    for (Corner* corner : found) {
      if (corner->is_found && asymmetry(clean, corner->at, half) > kLargestAsymmetry)
        corner->is_found = false;
    }
  }
}

void CharucoGrid::drop_misfits() {
  const std::vector<Corner> all = corners_;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].is_found) continue;
    const auto point = static_cast<int>(i);
    const cv::Point2d place = place_of(point);
    const auto off = [&](bool robust) {
      cv::Matx33d H;
      if (!homography_about(place, point, robust, &H)) return 0.0;
      const double square_px =
          cv::norm(mapped(H, place + cv::Point2d(0.5, 0)) - mapped(H, place - cv::Point2d(0.5, 0)));
      return cv::norm(mapped(H, place) - cv::Point2d(all[i].at)) /
             std::max(kCornerFits_px, kCornerFits_squares * square_px);
    };
    if (off(false) > 1 && off(true) > 1) corners_[i].is_found = false;
  }
}

std::vector<int> CharucoGrid::corners_about(const cv::Point2d& place, int without) const {
  const int columns = pattern_.columns - 1;
  const int rows = pattern_.rows - 1;
  std::vector<std::pair<double, int>> near;
  for (int row = std::max(0, static_cast<int>(place.y) - 2);
       row <= std::min(rows - 1, static_cast<int>(place.y) + 2); ++row) {
    for (int column = std::max(0, static_cast<int>(place.x) - 2);
         column <= std::min(columns - 1, static_cast<int>(place.x) + 2); ++column) {
      const int point = row * columns + column;
      if (point == without || !corners_[static_cast<std::size_t>(point)].is_found) continue;
      near.emplace_back(cv::norm(place - place_of(point)), point);
    }
  }
  std::sort(near.begin(), near.end());
  if (near.size() > kCornerNeighbours) near.resize(kCornerNeighbours);
  std::vector<int> points;
  for (const auto& [distance, point] : near) points.push_back(point);
  return points;
}

bool CharucoGrid::homography_about(const cv::Point2d& place, int without, bool robust,
                                   cv::Matx33d* image_from_board) const {
  const std::vector<int> points = corners_about(place, without);
  if (points.empty() || cv::norm(place - place_of(points.front())) > 1.5) return false;
  // Needs two corners in each of two rows: then not all are on one line.
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  std::vector<int> in_row(static_cast<std::size_t>(pattern_.rows), 0);
  for (const int point : points) {
    from.emplace_back(place_of(point));
    to.push_back(corners_[static_cast<std::size_t>(point)].at);
    ++in_row[static_cast<std::size_t>(point / (pattern_.columns - 1))];
  }
  if (std::count_if(in_row.begin(), in_row.end(), [](int n) { return n >= 2; }) < 2) return false;
  const cv::Mat H = cv::findHomography(from, to, robust ? cv::RANSAC : 0, kCornerFits_px);
  if (H.empty()) return false;
  *image_from_board = H;
  return true;
}

cv::Point2d CharucoGrid::place_of(int point) const {
  const int columns = pattern_.columns - 1;
  return {static_cast<double>(point % columns), static_cast<double>(point / columns)};
}

const CharucoGrid::Corner* CharucoGrid::corner_at(const cv::Point2d& place) const {
  const auto column = static_cast<int>(std::lround(place.x));
  const auto row = static_cast<int>(std::lround(place.y));
  if (column < 0 || row < 0 || column >= pattern_.columns - 1 || row >= pattern_.rows - 1)
    return nullptr;
  return &corners_[static_cast<std::size_t>(row * (pattern_.columns - 1) + column)];
}

}  // namespace alidade::internal

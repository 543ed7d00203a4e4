#include "core/pattern/charuco_layout.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/pattern/aruco_markers.h"
#include "core/pattern/corner_refinement.h"

namespace alidade::internal {
namespace {

// Distance of markers that confirm each other: diagonal neighbours. Those of one row would also
// agree on a board of other counts.
constexpr double kReach_squares = 1.5;
constexpr double kAgrees_squares = 0.4;  // far less than a step to another square
constexpr std::size_t kFewMarkers = 3;   // fewer may be an accident
// In a dictionary of a thousand codes more quads are markers by accident.
constexpr std::size_t kManyMarkers = 6;
// The largest dictionary of each kind, which contains the smaller ones.
constexpr std::array<int, 9> kLargestDictionaries = {3, 7, 11, 15, 16, 17, 18, 19, 20};
constexpr int kLastOfFour = 15;  // up to here each kind has four sizes
constexpr int kClearLead = 3;    // of votes; no single wrong marker gives as many

}  // namespace

cv::Point2d mapped(const cv::Matx33d& H, const cv::Point2d& p) {
  const cv::Vec3d x = H * cv::Vec3d(p.x, p.y, 1);
  return {x[0] / x[2], x[1] / x[2]};
}

CharucoLayout::CharucoLayout(const KnownPattern& pattern) : pattern_(pattern) {
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column)
      middles_[(column + row) % 2 == 1 ? 0 : 1].emplace_back(column - 0.5, row - 0.5);
  }
  // With an odd number of rows both layouts are the same.
  if (pattern.rows % 2 == 1) middles_[1] = middles_[0];
}

bool CharucoLayout::is_black(int column, int row) const {
  const bool turned = chosen_ == 1 && pattern_.rows % 2 == 0;
  return ((column + row) % 2 == 0) != turned;
}

bool CharucoLayout::is_undecided() const {
  return pattern_.rows % 2 == 0 && votes_[0] + votes_[1] > 0 &&
         std::abs(votes_[1] - votes_[0]) < kClearLead;
}

int CharucoLayout::agreement(const Marker& a, const Marker& b, std::size_t layout) const {
  const std::vector<cv::Point2d>& middles = middles_[layout];
  const cv::Point2d step =
      middles[static_cast<std::size_t>(b.id)] - middles[static_cast<std::size_t>(a.id)];
  if (cv::norm(step) > kReach_squares) return 0;
  const auto expects = [](const Marker& from, const Marker& to, const cv::Point2d& by) {
    return cv::norm(mapped(from.image_from_board, by) - mapped(to.image_from_board, {0, 0})) <
           kAgrees_squares * to.square_px;
  };
  return expects(a, b, step) || expects(b, a, -step) ? 1 : -1;
}

void CharucoLayout::look_for_others(const cv::Mat& image) {
  constexpr int kEvery = 4;
  const int turn = images_without_++;
  if (other_dictionary_ || turn % kEvery != 0) return;
  const int dictionary =
      kLargestDictionaries[static_cast<std::size_t>(turn / kEvery) % kLargestDictionaries.size()];
  int largest = 0;
  const std::vector<ArucoMarker> found = find_markers(image, dictionary);
  for (const ArucoMarker& marker : found) largest = std::max(largest, marker.id);
  if (found.size() < kManyMarkers) return;
  int smallest = dictionary;
  while (dictionary <= kLastOfFour && smallest > dictionary - 3 &&
         largest < kMarkerDictionaries[static_cast<std::size_t>(smallest - 1)].markers)
    --smallest;
  if (smallest != pattern_.dictionary) other_dictionary_ = smallest;
}

std::vector<CharucoLayout::Marker> CharucoLayout::markers_in(const cv::Mat& image) {
  const double marker_part = pattern_.marker_m / pattern_.size_m;  // of a square
  const auto h = static_cast<float>(marker_part / 2);
  const std::vector<cv::Point2f> outline = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
  std::vector<Marker> seen;
  for (const ArucoMarker& found : find_markers(image, pattern_.dictionary)) {
    if (found.id >= pattern_.markers()) continue;
    seen.push_back({found.id, cv::getPerspectiveTransform(outline, found.corners),
                    least_distance(found.corners) / marker_part});
  }
  if (seen.size() >= kFewMarkers) {
    ++images_with_markers_;
  } else if (images_with_markers_ == 0) {
    look_for_others(image);
  }
  const std::size_t count = seen.size();
  for (const std::size_t layout : {std::size_t{0}, std::size_t{1}}) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < i; ++j)
        votes_[layout] += agreement(seen[i], seen[j], layout) > 0 ? 1 : 0;
    }
  }
  chosen_ = votes_[1] > votes_[0] ? 1 : 0;
  if (is_undecided()) return {};

  std::vector<std::vector<int>> agree(count, std::vector<int>(count, 0));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      agree[i][j] = agree[j][i] = agreement(seen[i], seen[j], chosen_);
  }
  // Drops the worst marker first: those that disagree with it may be right.
  std::vector<Marker> kept;
  std::vector<std::size_t> left(count);
  std::iota(left.begin(), left.end(), 0);
  while (!left.empty()) {
    int least = 1;
    auto worst = left.end();
    for (auto i = left.begin(); i != left.end(); ++i) {
      int sum = 0;
      for (const std::size_t j : left) sum += agree[*i][j];
      if (sum >= least) continue;
      least = sum;
      worst = i;
    }
    if (worst == left.end()) break;
    left.erase(worst);
  }
  for (const std::size_t i : left) {
    const cv::Point2d middle = middles()[static_cast<std::size_t>(seen[i].id)];
    kept.push_back(seen[i]);
    kept.back().image_from_board =
        seen[i].image_from_board * cv::Matx33d(1, 0, -middle.x, 0, 1, -middle.y, 0, 0, 1);
  }
  return kept;
}

}  // namespace alidade::internal

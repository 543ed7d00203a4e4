#include "core/pattern/tag_spacing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/pattern/pattern_checks.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMostGaps = 2000;  // more change nothing
constexpr std::size_t kFewestGaps = 8;
constexpr double kLeastGapError = 0.015;  // more than a lens bends over two tags
constexpr double kLeastRoughError = 0.06;
constexpr double kGapSigmas = 5;
constexpr int kFewestSteps = 5;
constexpr double kMostSteps = 0.8;  // share of all steps that must agree
constexpr double kAcross = 0.25;    // of the distance; off the line of a tag's side

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The gap from four points on a line at 0, 1, 1 + gap and 2 + gap.
std::optional<double> gap_of(const cv::Point2f& a, const cv::Point2f& b, const cv::Point2f& c,
                             const cv::Point2f& d) {
  const double ratio = cv::norm(c - a) * cv::norm(d - b) / (cv::norm(c - b) * cv::norm(d - a));
  if (!(ratio > 1)) return std::nullopt;
  return std::sqrt(ratio / (ratio - 1)) - 1;
}

// The other tag's middle in this tag's frame: from its middle, right and up, in sides.
cv::Point2f place_of(const NumberedTag& other, const NumberedTag& tag) {
  const cv::Point2f middle =
      (other.corners[0] + other.corners[1] + other.corners[2] + other.corners[3]) / 4;
  const cv::Mat H = cv::getPerspectiveTransform(
      tag.corners, std::vector<cv::Point2f>{{-.5F, -.5F}, {.5F, -.5F}, {.5F, .5F}, {-.5F, .5F}});
  std::vector<cv::Point2f> place;
  cv::perspectiveTransform(std::vector<cv::Point2f>{middle}, place, H);
  return place[0];
}

}  // namespace

void TagSpacing::add(const std::vector<NumberedTag>& tags, bool rough) {
  std::vector<double>& gaps = rough ? rough_gaps_ : gaps_;
  if (gaps.size() >= kMostGaps) return;
  const auto keep = [&](std::optional<double> measured) {
    if (measured) gaps.push_back(*measured);
  };
  for (const NumberedTag& tag : tags) {
    for (const NumberedTag& other : tags) {
      if (other.id == tag.id) continue;
      const cv::Point2f place = place_of(other, tag);
      const auto& a = tag.corners;
      const auto& b = other.corners;
      const bool right = place.x > 1 && std::abs(place.y) < kAcross * place.x;
      const bool above = place.y > 1 && std::abs(place.x) < kAcross * place.y;
      if (right && other.id == tag.id + 1) {
        keep(gap_of(a[0], a[1], b[0], b[1]));
        keep(gap_of(a[3], a[2], b[3], b[2]));
      } else if (above) {
        if (place.y < 1.5 * (1 + pattern_.gap)) ++steps_upward_[other.id - tag.id];
        if (other.id != tag.id + pattern_.columns) continue;
        keep(gap_of(a[0], a[3], b[0], b[3]));
        keep(gap_of(a[1], a[2], b[1], b[2]));
      }
    }
  }
  gap_ = measured_gap();
}

std::string TagSpacing::doubt() const {
  int all = 0;
  std::pair<int, int> most = {0, 0};
  for (const auto& [step, count] : steps_upward_) {
    all += count;
    if (count > most.second) most = {step, count};
  }
  if (most.second >= kFewestSteps && most.second > kMostSteps * all &&
      most.first != pattern_.columns) {
    return most.first < 0
               ? "its tags are numbered from the top downwards; expected a grid whose first tag is "
                 "the lower left one, as --print draws it"
               : formatted(
                     "its tags lie in rows of %.0f, but %.0f were given; give the tags of a row "
                     "first, then the rows",
                     most.first, pattern_.columns);
  }
  if (gap_ == pattern_.gap) return "";
  return formatted("the gap between its tags is %.2f of a tag's side, but %.4g was given; is it ",
                   gap_, pattern_.gap) +
         "aprilgrid:" + std::to_string(pattern_.columns) + "x" + std::to_string(pattern_.rows) +
         formatted(":%.6gmm:%.2f?", 1000 * pattern_.size_m, gap_);
}

double TagSpacing::measured_gap() const {
  const bool rough = gaps_.size() < kFewestGaps;
  const std::vector<double>& gaps = rough ? rough_gaps_ : gaps_;
  if (gaps.size() < kFewestGaps) return pattern_.gap;
  const double gap = median_of(gaps);
  std::vector<double> off;
  off.reserve(gaps.size());
  for (const double g : gaps) off.push_back(std::abs(g - gap));
  const double sigma = 1.25 * 1.48 * median_of(off) / std::sqrt(static_cast<double>(gaps.size()));
  const double least = rough ? kLeastRoughError : kLeastGapError;
  return std::abs(gap - pattern_.gap) < std::max(least, kGapSigmas * sigma) ? pattern_.gap : gap;
}

}  // namespace alidade::internal

#include "core/pattern/pattern_progress.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/model/angle.h"
#include "core/model/median.h"
#include "core/pattern/image_cells.h"
#include "core/pattern/pattern_checks.h"
#include "core/pattern/pattern_start.h"
#include "core/pattern/pattern_view.h"

namespace alidade {
namespace {

constexpr double kRecent_s = 3;  // the time that a person who gets advice looks back on
constexpr double kTogether = 3;  // frame intervals; up to this two frames are consecutive
constexpr std::size_t kLeastPoints = 6;
constexpr std::size_t kViews = 80;   // for tilt and distance
constexpr double kOutlying = 0.025;  // of the views on each side: poses of few or wrong points

// Limits.
constexpr double kEnough_s = 20;
constexpr double kUnseen_s = 1.5;
constexpr double kSeldom = 0.5;
constexpr double kUnfollowed = 0.025;
constexpr double kCovered = 0.2;
constexpr double kTilt = 15 * kPi / 180;
constexpr double kDistanceRatio = 1.2;
constexpr double kSpeed = 0.12;

double quantile(std::vector<double> values, double part) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                       std::lround(part * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Frames that allow a pose, evenly thinned to kViews.
PatternData some_views(const PatternData& data) {
  PatternData views;
  views.width = data.width;
  views.height = data.height;
  views.points_m = data.points_m;
  std::vector<const PatternFrame*> all;
  for (const PatternFrame& frame : data.frames) {
    if (frame.observations.size() >= kLeastPoints) all.push_back(&frame);
  }
  const std::size_t count = std::min(kViews, all.size());
  for (std::size_t i = 0; i < count; ++i) views.frames.push_back(*all[i * all.size() / count]);
  return views;
}

// From the views themselves, else a typical lens. Tilt shows by how narrow the pattern is, whatever
// the lens.
LensVector rough_lens(const PatternData& data) {
  constexpr double kShortest = 0.3;  // image widths
  constexpr double kLongest = 30;
  const std::optional<LensVector> found = internal::start_lens(data, {});
  const auto focal_length = index(LensParameter::kFocalLengthU);
  if (found && (*found)[focal_length] > kShortest * data.width &&
      (*found)[focal_length] < kLongest * data.width) {
    return *found;
  }
  LensVector lens = LensVector::Zero();
  lens[focal_length] = lens[index(LensParameter::kFocalLengthV)] = data.width;
  lens[index(LensParameter::kCentreU)] = data.width / 2.0;
  lens[index(LensParameter::kCentreV)] = data.height / 2.0;
  return lens;
}

void measure_views(const PatternData& data, PatternProgress* progress) {
  const PatternData views = some_views(data);
  if (views.frames.empty()) return;
  const Vector3<double> middle = middle_of(data.points_m);
  std::vector<double> side;
  std::vector<double> up;
  std::vector<double> distance_m;
  for (const internal::FramePose& pose : internal::start_poses(views, rough_lens(data))) {
    const PatternView view = pattern_view(pose.R_pattern_from_camera, pose.centre, middle);
    side.push_back(view.tilt.x());
    up.push_back(view.tilt.y());
    distance_m.push_back(view.distance_m);
  }
  if (side.empty()) return;
  progress->tilt = {
      std::max(0.0, -quantile(side, kOutlying)), std::max(0.0, quantile(side, 1 - kOutlying)),
      std::max(0.0, -quantile(up, kOutlying)), std::max(0.0, quantile(up, 1 - kOutlying))};
  progress->distance_ratio = quantile(distance_m, 1 - kOutlying) / quantile(distance_m, kOutlying);
}

void measure_coverage(const PatternData& data, PatternProgress* progress) {
  const ImageCells cells(data.width, data.height);
  std::vector<char> seen(static_cast<std::size_t>(cells.count()), 0);
  for (const PatternFrame& frame : data.frames) {
    for (const PatternObservation& observation : frame.observations)
      seen[static_cast<std::size_t>(cells.cell_of(observation.u))] = 1;
  }
  std::array<int, 9> all{};
  std::array<int, 9> hit{};
  for (int cell = 0; cell < cells.count(); ++cell) {
    const Vector2<double> centre = 0.5 * (cells.low(cell) + cells.high(cell));
    const int ninth = 3 * static_cast<int>(3 * centre.y() / data.height) +
                      static_cast<int>(3 * centre.x() / data.width);
    ++all[static_cast<std::size_t>(ninth)];
    hit[static_cast<std::size_t>(ninth)] += seen[static_cast<std::size_t>(cell)];
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    progress->covered[i] = all[i] == 0 ? 1 : static_cast<double>(hit[i]) / all[i];
}

void measure_motion(const PatternData& data, PatternProgress* progress) {
  const double end_s = data.frames.back().time_s;
  const double together_s = kTogether * internal::frame_interval(data);
  const PatternFrame* before = nullptr;
  double squares = 0;
  int recent = 0;
  int recent_found = 0;
  for (const PatternFrame& frame : data.frames) {
    const bool is_recent = frame.time_s > end_s - kRecent_s;
    recent += is_recent ? 1 : 0;
    if (frame.observations.empty()) continue;
    recent_found += is_recent ? 1 : 0;
    const double apart_s = before == nullptr ? 0 : frame.time_s - before->time_s;
    if (apart_s > 0 && apart_s <= together_s) {
      const double speed = internal::shift_between(*before, frame) / apart_s / data.height;
      squares += apart_s * speed * speed;
      progress->seen_s += apart_s;
    }
    before = &frame;
  }
  if (progress->seen_s > 0) progress->speed = std::sqrt(squares / progress->seen_s);
  const double begin_s = data.frames.front().time_s;
  progress->last_seen_s = before == nullptr ? 0 : before->time_s - begin_s;
  progress->unseen_s = end_s - begin_s - progress->last_seen_s;
  progress->found = static_cast<double>(recent_found) / recent;
  progress->unfollowed = unfollowed_motion(data, end_s - kRecent_s);
}

// The observation of a point in a frame; null if it is not seen. Observations are ordered by point.
const PatternObservation* seen_in(const PatternFrame& frame, int point) {
  const auto at = std::lower_bound(
      frame.observations.begin(), frame.observations.end(), point,
      [](const PatternObservation& observation, int p) { return observation.point < p; });
  return at == frame.observations.end() || at->point != point ? nullptr : &*at;
}

// Distance of the middle frame from the cubic through the other four: px, median of the points that
// all five show. Nothing if there are none.
std::optional<double> middle_misses(const std::array<const PatternFrame*, 5>& five) {
  std::array<double, 5> weight{};
  for (std::size_t i = 0; i < 5; ++i) {
    if (i == 2) continue;
    weight[i] = 1;
    for (std::size_t j = 0; j < 5; ++j) {
      if (j == 2 || j == i) continue;
      weight[i] *= (five[2]->time_s - five[j]->time_s) / (five[i]->time_s - five[j]->time_s);
    }
  }
  std::vector<double> misses;
  for (const PatternObservation& observation : five[2]->observations) {
    Vector2<double> miss = observation.u;
    bool in_all = true;
    for (std::size_t i = 0; i < 5 && in_all; ++i) {
      if (i == 2) continue;
      const PatternObservation* there = seen_in(*five[i], observation.point);
      in_all = there != nullptr;
      if (in_all) miss -= weight[i] * there->u;
    }
    if (in_all) misses.push_back(miss.norm());
  }
  if (misses.empty()) return std::nullopt;
  return median(std::move(misses));
}

template <std::size_t count>
std::string listed(const std::array<double, count>& values, double mark,
                   const std::array<const char*, count>& names) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    if (values[i] < mark) text += (text.empty() ? "" : ", ") + std::string(names[i]);
  }
  return text;
}

// Lines about what was not shown yet.
std::vector<std::string> still_to_show(const PatternProgress& progress) {
  std::vector<std::string> lines;
  if (progress.extent < internal::kSmallExtent)
    lines.emplace_back("go nearer: the pattern is small in the image");
  const std::string places = listed<9>(progress.covered, kCovered,
                                       {"upper left", "top", "upper right", "left", "middle",
                                        "right", "lower left", "bottom", "lower right"});
  if (!places.empty()) lines.push_back("show it in these parts of the image: " + places);
  const std::string sides = listed<4>(progress.tilt, kTilt, {"left", "right", "upper", "lower"});
  if (!sides.empty())
    lines.push_back("tilt it by 30 to 45 degrees, with each of these sides nearer: " + sides);
  if (progress.distance_ratio < kDistanceRatio)
    lines.emplace_back("show it nearer and farther: all distances are alike");
  if (progress.speed < kSpeed) lines.emplace_back(internal::kMoveFaster);
  return lines;
}

}  // namespace

double unfollowed_motion(const PatternData& data, double since_s) {
  const double together_s = kTogether * internal::frame_interval(data);
  std::vector<double> misses;
  std::array<const PatternFrame*, 5> five{};
  std::size_t in_a_row = 0;
  for (const PatternFrame& frame : data.frames) {
    if (frame.observations.empty() || frame.time_s <= since_s) continue;
    if (in_a_row > 0 && frame.time_s - five[4]->time_s > together_s) in_a_row = 0;
    std::rotate(five.begin(), five.begin() + 1, five.end());
    five[4] = &frame;
    if (++in_a_row < five.size()) continue;
    if (const std::optional<double> miss = middle_misses(five)) misses.push_back(*miss);
  }
  return misses.empty() ? 0 : median(std::move(misses)) / data.height;
}

PatternProgress progress_of(const PatternData& data) {
  PatternProgress progress;
  if (data.frames.empty() || data.width <= 0 || data.height <= 0) return progress;
  progress.extent = internal::views_of(data).extent;
  measure_motion(data, &progress);
  measure_coverage(data, &progress);
  measure_views(data, &progress);
  return progress;
}

std::vector<std::string> advice_of(const PatternProgress& progress) {
  std::vector<std::string> lines;
  if (progress.unseen_s >= kUnseen_s) {
    lines.push_back(
        (progress.extent == 0
             ? "the pattern is not found"
             : internal::formatted("the pattern was last found at %.0f s", progress.last_seen_s)) +
        "; is it this pattern, whole in view, in focus and lit?");
  } else if (progress.found < kSeldom) {
    lines.push_back(
        internal::formatted("the pattern is found in few images, %.0f %% of them; move half as "
                            "fast, or give more light and keep it in view",
                            10 * std::round(10 * progress.found)));
  } else if (progress.unfollowed > kUnfollowed) {
    // The error of a cubic through the frames around grows with the fourth power of the speed.
    // Rounded to tens, so that the line changes only when the speed has.
    lines.push_back(internal::formatted(
        "move at %.0f %% of this speed or less: the image moves too far from one frame to the next",
        10 * std::max(1.0, std::floor(10 * std::pow(kUnfollowed / progress.unfollowed, 0.25)))));
  }
  // Other advice is of no use before the pattern was seen at all.
  if (progress.extent == 0) return lines;
  const std::vector<std::string> rest = still_to_show(progress);
  lines.insert(lines.end(), rest.begin(), rest.end());
  return lines;
}

bool is_enough(const PatternProgress& progress) {
  return progress.seen_s >= kEnough_s && progress.unfollowed <= kUnfollowed &&
         still_to_show(progress).empty();
}

}  // namespace alidade

#include "core/pattern/pattern_checks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

#include "core/model/median.h"

namespace alidade::internal {
namespace {

using Box = Eigen::AlignedBox2d;

std::string nearer(const PatternViews& views) {
  if (views.extent >= kSmallExtent) return "";
  return formatted("go nearer, as the pattern fills only %.0f %% of the image's width, and ",
                   100 * views.extent);
}

}  // namespace

std::string formatted(const char* format, double a, double b) {
  char text[320];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

std::optional<std::string> bad_input(const PatternData& data) {
  if (data.width <= 0 || data.height <= 0)
    return formatted("the image has %.0f x %.0f pixels; both must be above 0", data.width,
                     data.height);
  for (const auto& p : data.points_m) {
    if (!all_finite(p)) return "a point of the pattern is not a finite number";
  }
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const PatternFrame& frame = data.frames[f];
    const auto number = static_cast<double>(f);
    if (!std::isfinite(frame.time_s))
      return formatted("frame %.0f: its time is not a finite number", number);
    if (f > 0 && frame.time_s <= data.frames[f - 1].time_s) {
      return formatted(frame.time_s == data.frames[f - 1].time_s
                           ? "frame %.0f: it repeats the time stamp of the frame before, %.6f s; "
                             "leave repeated frames out"
                           : "frame %.0f: its time stamp, %.6f s, is earlier than the one before; "
                             "times must increase",
                       number, frame.time_s);
    }
    for (const PatternObservation& observation : frame.observations) {
      if (observation.point < 0 || observation.point >= static_cast<int>(data.points_m.size())) {
        return formatted("frame %.0f: the pattern has no point %.0f", number, observation.point);
      }
      if (!all_finite(observation.u))
        return formatted("frame %.0f: a detection is not a finite number", number);
    }
  }
  return std::nullopt;
}

double frame_interval(const PatternData& data) {
  std::vector<double> intervals;
  for (std::size_t f = 1; f < data.frames.size(); ++f)
    intervals.push_back(data.frames[f].time_s - data.frames[f - 1].time_s);
  return intervals.empty() ? 0 : median(std::move(intervals));
}

PatternViews views_of(const PatternData& data) {
  PatternViews views;
  std::vector<Box> of_point(data.points_m.size());
  std::vector<double> extents;
  for (const PatternFrame& frame : data.frames) {
    if (frame.observations.empty()) continue;
    ++views.frames;
    Box of_frame;
    for (const PatternObservation& observation : frame.observations) {
      of_frame.extend(observation.u);
      of_point[static_cast<std::size_t>(observation.point)].extend(observation.u);
    }
    const Vector2<double> sides = of_frame.sizes();
    extents.push_back(std::max(sides.x() / data.width, sides.y() / data.height));
  }
  std::vector<double> travels;
  for (const Box& box : of_point) {
    if (!box.isEmpty()) travels.push_back(box.diagonal().norm());
  }
  if (!extents.empty()) views.extent = median(std::move(extents));
  if (!travels.empty()) views.travel_px = median(std::move(travels));
  return views;
}

double shift_between(const PatternFrame& a, const PatternFrame& b) {
  std::vector<double> shifts;
  std::size_t j = 0;
  for (const PatternObservation& of_a : a.observations) {
    while (j < b.observations.size() && b.observations[j].point < of_a.point) ++j;
    if (j == b.observations.size()) break;
    if (b.observations[j].point == of_a.point)
      shifts.push_back((b.observations[j].u - of_a.u).norm());
  }
  return shifts.empty() ? 0 : median(std::move(shifts));
}

std::string how_to_move(const PatternViews& views) { return nearer(views) + kMoveFaster; }

std::string how_to_show(const PatternViews& views) {
  return nearer(views) + "show the pattern tilted by 30 to 45 degrees to all sides, near and far";
}

}  // namespace alidade::internal

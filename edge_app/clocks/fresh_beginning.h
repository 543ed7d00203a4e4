#pragma once
// begins_fresh(): whether the first frames of a recording arrived without a long wait. The later
// frames of the recording show it. In a live stream these have not come yet (frame_clock.h).
// Seconds. Pure; allocates.

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/model/arrival_pace.h"
#include "platform/streams/frame.h"

namespace alidade {

// stamps: in order of arrival; those of the first 10 s are judged. If all of these have sender
// times, true if the first frame is later than the least late one by no more than jitter. Otherwise
// true if no two arrivals follow each other in less than 0.4 of the usual interval. Also true for
// fewer than two frames.
[[nodiscard]] inline bool begins_fresh(const std::vector<FrameStamp>& stamps) {
  constexpr double kLook_s = 10;
  constexpr double kBurst = 0.4;  // of the usual interval
  std::vector<double> intervals;
  double least_s = std::numeric_limits<double>::infinity();
  bool timed = true;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const FrameStamp& stamp = stamps[i];
    if (!(stamp.receive_time_s <= stamps.front().receive_time_s + kLook_s)) break;
    timed = timed && stamp.sender_time_s;
    if (timed) least_s = std::min(least_s, stamp.receive_time_s - *stamp.sender_time_s);
    if (i > 0) intervals.push_back(stamp.receive_time_s - stamps[i - 1].receive_time_s);
  }
  if (intervals.empty()) return true;
  if (timed) {
    const FrameStamp& first = stamps.front();
    return first.receive_time_s - *first.sender_time_s <= least_s + ArrivalPace::kBacklog_s;
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  const double usual_s = *middle;
  return *std::min_element(intervals.begin(), intervals.end()) >= kBurst * usual_s;
}

}  // namespace alidade

#include "core/pattern/pattern_doubts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>

#include "core/pattern/pattern_checks.h"

namespace alidade {
namespace {

// Between two consecutive frames. Motion by the pattern's own size within a frame would blur it
// away.
constexpr double kJump = 0.7;  // share of the pattern's diagonal in the image
constexpr int kFewestJumps = 3;
constexpr double kNextFrame = 1.5;  // intervals
constexpr double kLongGap_s = 1;

double diagonal_of(const PatternFrame& frame) {
  Eigen::AlignedBox2d box;
  for (const PatternObservation& seen : frame.observations) box.extend(seen.u);
  return box.diagonal().norm();
}

bool has_a_point_twice(const PatternFrame& frame) {
  return std::adjacent_find(frame.observations.begin(), frame.observations.end(),
                            [](const PatternObservation& a, const PatternObservation& b) {
                              return a.point == b.point;
                            }) != frame.observations.end();
}

}  // namespace

std::vector<std::string> doubts_of(const PatternData& data) {
  std::vector<std::string> doubts;
  const double interval_s = internal::frame_interval(data);
  const PatternFrame* before = nullptr;
  int jumps = 0;
  int twice = 0;
  for (const PatternFrame& frame : data.frames) {
    if (frame.observations.empty()) continue;
    twice += has_a_point_twice(frame) ? 1 : 0;
    if (before != nullptr) {
      const double apart_s = frame.time_s - before->time_s;
      if (apart_s <= kNextFrame * interval_s &&
          internal::shift_between(*before, frame) > kJump * diagonal_of(frame)) {
        ++jumps;
      }
      if (apart_s > kLongGap_s) {
        const double start_s = data.frames.front().time_s;
        doubts.push_back(internal::formatted(
            "the pattern was not found from %.1f to %.1f s; keep it in view, in focus and lit",
            before->time_s - start_s, frame.time_s - start_s));
      }
    }
    before = &frame;
  }
  if (jumps >= kFewestJumps) {
    doubts.push_back(internal::formatted(
        "the pattern jumps %.0f times from one frame to the next; is a second one in view? Cover "
        "it. If not, move by less than %.0f %% of the pattern's diagonal a frame",
        jumps, 100 * kJump));
  }
  if (twice >= kFewestJumps) {
    doubts.push_back(internal::formatted(
        "parts of the pattern are seen twice in %.0f images; is a second one in view? Cover "
        "it",
        twice));
  }
  return doubts;
}

}  // namespace alidade

#include "core/calibration/motion_match.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/model/median.h"

namespace alidade::internal {

std::vector<ImageMotion> image_motion(const AdjustmentData& data, double baseline_s) {
  struct Seen {
    int landmark;
    Vector2<double> u;
  };
  const std::size_t frames = data.frame_time_s.size();
  std::vector<std::vector<Seen>> seen(frames);
  for (const auto& o : data.observations) {  // by landmark, so each frame's list is sorted
    seen[static_cast<std::size_t>(o.frame)].push_back({o.landmark, o.u});
  }
  constexpr std::size_t kMinShared = 3;
  constexpr double kLongestBaselines = 2;  // beyond, tracking was lost in between
  std::vector<Vector2<double>> position(frames, Vector2<double>::Zero());
  std::vector<int> chain(frames, 0);
  std::vector<double> du;
  std::vector<double> dv;
  // A frame without observations does not break the chain: nothing was tracked in it.
  std::size_t before = 0;
  for (std::size_t i = 1; i < frames; ++i) {
    if (seen[i].empty()) continue;
    du.clear();
    dv.clear();
    auto a = seen[before].begin();
    for (const Seen& b : seen[i]) {
      while (a != seen[before].end() && a->landmark < b.landmark) ++a;
      if (a == seen[before].end()) break;
      if (a->landmark != b.landmark) continue;
      du.push_back(b.u.x() - a->u.x());
      dv.push_back(b.u.y() - a->u.y());
    }
    const bool linked = du.size() >= kMinShared;
    chain[i] = chain[before] + (linked ? 0 : 1);
    if (linked) position[i] = position[before] + Vector2<double>(median(du), median(dv));
    before = i;
  }
  std::vector<ImageMotion> motion;
  std::size_t to = 0;
  for (std::size_t from = 0; from < frames; ++from) {
    if (seen[from].empty()) continue;
    // Frames without observations lie between: only every second one may be used.
    const auto is_too_early = [&](std::size_t frame) {
      return seen[frame].empty() || data.frame_time_s[frame] < data.frame_time_s[from] + baseline_s;
    };
    while (to < frames && is_too_early(to)) ++to;
    if (to == frames) break;
    if (chain[from] != chain[to]) continue;
    if (data.frame_time_s[to] > data.frame_time_s[from] + kLongestBaselines * baseline_s) continue;
    motion.push_back(
        {data.frame_time_s[from], data.frame_time_s[to], position[to] - position[from]});
  }
  return motion;
}

MotionMatch match_motion(const std::vector<ImageMotion>& motion, const TrajectorySpline& telemetry,
                         double centre_s, double half_range_s, const Vector2<double>& signs) {
  // Telemetry sampled on a grid, as every candidate needs it at all frames.
  constexpr double kGridStep_s = 2e-3;
  const int grid_size =
      static_cast<int>((telemetry.end_s() - telemetry.begin_s()) / kGridStep_s) + 1;
  std::vector<Vector2<double>> grid;
  grid.reserve(static_cast<std::size_t>(grid_size));
  int segment = 0;
  for (int i = 0; i < grid_size; ++i) {
    const auto basis = telemetry.basis(telemetry.begin_s() + i * kGridStep_s, segment);
    segment = basis.segment;
    grid.push_back(telemetry.position(basis).vector());
  }
  const auto look_up = [&](double time, Vector2<double>* angle) {
    const double place = (time - telemetry.begin_s()) / kGridStep_s;
    if (!(place >= 0) || place >= grid_size - 1) return false;
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    *angle = (1 - share) * grid[i] + share * grid[i + 1];
    return true;
  };
  // How many motions begin during one of them.
  double overlapping = 1;
  if (motion.size() > 1) {
    const double each_s =
        (motion.back().from_s - motion.front().from_s) / static_cast<double>(motion.size() - 1);
    overlapping = (motion.front().to_s - motion.front().from_s) / each_s;
  }
  bool apart = true;
  const auto evaluate = [&](double shift) {
    MotionMatch match;
    match.shift_s = shift;
    Vector2<double> mp = Vector2<double>::Zero();
    Vector2<double> mm = Vector2<double>::Zero();
    Vector2<double> pp = Vector2<double>::Zero();
    std::size_t used = 0;
    for (const ImageMotion& m : motion) {
      Vector2<double> from;
      Vector2<double> to;
      if (!look_up(m.from_s + shift, &from) || !look_up(m.to_s + shift, &to)) continue;
      const Vector2<double> p(-std::cos(0.5 * (from[1] + to[1])) * signs.x() * (to[0] - from[0]),
                              signs.y() * (to[1] - from[1]));
      mp += m.shift.cwiseProduct(p);
      mm += m.shift.cwiseAbs2();
      pp += p.cwiseAbs2();
      ++used;
    }
    // A candidate that leaves most of the video without telemetry is no match.
    if (2 * used < motion.size()) return match;
    apart = false;
    const auto normalised = [](double ab, double aa, double bb) {
      return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0.0;
    };
    match.correlation = normalised(mp.sum(), mm.sum(), pp.sum());
    match.focal_length = pp.sum() > 0 ? mp.sum() / pp.sum() : 0;
    for (int axis = 0; axis < 2; ++axis) {
      if (!(pp[axis] > 0)) continue;
      const double left = std::max(0.0, mm[axis] - mp[axis] * mp[axis] / pp[axis]);
      // Motions overlap: those of one baseline count as one.
      const double worth = static_cast<double>(used) / std::max(1.0, overlapping);
      match.by_axis[static_cast<std::size_t>(axis)] = {mp[axis] / pp[axis],
                                                       std::sqrt(left / (pp[axis] * worth))};
    }
    return match;
  };

  MotionMatch best;
  const auto search = [&](double centre, double half_range, int steps) {
    int best_step = 0;
    for (int i = -steps; i <= steps; ++i) {
      const MotionMatch match = evaluate(centre + half_range * i / steps);
      if (match.correlation <= best.correlation) continue;
      best = match;
      best_step = i;
    }
    return best_step;
  };
  const int steps = std::max(10, static_cast<int>(half_range_s / 0.02));
  const bool at_edge = std::abs(search(centre_s, half_range_s, steps)) == steps;
  double range_s = half_range_s / steps;
  while (range_s > 1e-4) {
    search(best.shift_s, range_s, 5);
    range_s /= 5;
  }
  best.at_edge = at_edge;
  best.apart = apart;
  best.centre_s = centre_s;
  best.half_range_s = half_range_s;
  return best;
}

namespace {

// Correlation of pan alone and of tilt alone, with the telemetry's own signs.
Vector2<double> axis_correlation(const std::vector<ImageMotion>& motion,
                                 const TrajectorySpline& telemetry, const MotionMatch& match) {
  Vector2<double> mp = Vector2<double>::Zero();
  Vector2<double> mm = Vector2<double>::Zero();
  Vector2<double> pp = Vector2<double>::Zero();
  for (const ImageMotion& m : motion) {
    const double from_s = m.from_s + match.shift_s;
    const double to_s = m.to_s + match.shift_s;
    if (from_s < telemetry.begin_s() || to_s > telemetry.end_s()) continue;
    const Vector2<double> turned =
        telemetry.position(to_s).vector() - telemetry.position(from_s).vector();
    const Vector2<double> shift(-m.shift.x(), m.shift.y());
    mp += shift.cwiseProduct(turned);
    mm += shift.cwiseAbs2();
    pp += turned.cwiseAbs2();
  }
  // An axis that does not move gets 0.
  return mp.cwiseQuotient(mm.cwiseProduct(pp).cwiseSqrt().cwiseMax(1e-300));
}

}  // namespace

ReversedAxes reversed_axes(const std::vector<ImageMotion>& motion,
                           const TrajectorySpline& telemetry, const MotionMatch& match) {
  constexpr double kMinCorrelation = 0.9;
  constexpr double kMinAxisCorrelation = 0.8;
  constexpr double kMuchLess = 1.0 / 3;  // of what is unexplained with the signs as they are
  const auto unexplained = [](const MotionMatch& m) { return 1 - m.correlation * m.correlation; };
  double least = kMuchLess * unexplained(match);
  ReversedAxes reversed;
  for (const Vector2<double>& signs :
       {Vector2<double>(-1, 1), Vector2<double>(1, -1), Vector2<double>(-1, -1)}) {
    const MotionMatch other =
        match_motion(motion, telemetry, match.centre_s, match.half_range_s, signs);
    if (other.correlation < kMinCorrelation || unexplained(other) > least) continue;
    // An axis that hardly moves does not show its sign, however well the other axis correlates.
    const Vector2<double> each = signs.cwiseProduct(axis_correlation(motion, telemetry, other));
    if (signs.x() < 0 && each.x() < kMinAxisCorrelation) continue;
    if (signs.y() < 0 && each.y() < kMinAxisCorrelation) continue;
    least = unexplained(other);
    reversed = {signs.x() < 0, signs.y() < 0};
  }
  return reversed;
}

}  // namespace alidade::internal

#include "edge_app/check/motion_fit.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "core/model/recording_needs.h"
#include "edge_app/self_calibration/stale_repeats.h"

namespace alidade {
namespace {

constexpr double kStep_s = 0.01;
constexpr int kFirstSteps = 100;       // to both sides
constexpr double kWell = 0.9;          // of the motion
constexpr double kLargestGap_s = 0.5;  // between samples: TelemetryLimits

MotionFit fit_at(const std::vector<TimedShift>& motions, const HeadPath& head, double offset_s) {
  MotionFit fit;
  for (const TimedShift& motion : motions) {
    Vector2<double> from;
    Vector2<double> to;
    if (!head.at(motion.from_s + offset_s, &from) || !head.at(motion.to_s + offset_s, &to))
      continue;
    const Vector2<double> p(-std::cos(0.5 * (from[1] + to[1])) * (to[0] - from[0]),
                            to[1] - from[1]);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      const double m = motion.shift[a];
      fit.own[axis].mp += m * p[a];
      fit.own[axis].pp += p[a] * p[a];
      fit.other[axis].mp += m * p[1 - a];
      fit.other[axis].pp += p[1 - a] * p[1 - a];
      fit.mm[axis] += m * m;
    }
    ++fit.used;
  }
  return fit;
}

}  // namespace

HeadPath::HeadPath(const std::vector<PanTiltSample>& samples) {
  for (const PanTiltSample& sample : samples) {
    Vector2<double> angle(sample.pan_rad, sample.tilt_rad);
    const double time_s = middle_time_s(sample);
    if (!std::isfinite(time_s) || !all_finite(angle)) continue;
    if (!angles_.empty()) {
      if (!(time_s > times_.back())) continue;
      for (int axis = 0; axis < 2; ++axis) {
        angle[axis] = angles_.back()[axis] + wrap_angle(angle[axis] - angles_.back()[axis]);
      }
    }
    times_.push_back(time_s);
    angles_.push_back(angle);
  }
}

bool HeadPath::at(double time_s, Vector2<double>* angle) const {
  const auto next = std::upper_bound(times_.begin(), times_.end(), time_s);
  if (next == times_.begin() || next == times_.end()) return false;
  const auto i = static_cast<std::size_t>(next - times_.begin());
  const double gap_s = times_[i] - times_[i - 1];
  if (gap_s > kLargestGap_s) return false;
  const double share = (time_s - times_[i - 1]) / gap_s;
  *angle = (1 - share) * angles_[i - 1] + share * angles_[i];
  return true;
}

double HeadPath::range() const {
  Vector2<double> least = Vector2<double>::Zero();
  Vector2<double> most = Vector2<double>::Zero();
  for (const Vector2<double>& angle : angles_) {
    least = least.cwiseMin(angle - angles_.front());
    most = most.cwiseMax(angle - angles_.front());
  }
  return (most - least).maxCoeff();
}

std::vector<TimedShift> over_baseline(const std::vector<TimedShift>& shifts) {
  std::vector<TimedShift> motions;
  std::size_t next_begin = 0;
  for (std::size_t begin = 0; begin < shifts.size(); begin = next_begin) {
    TimedShift motion = shifts[begin];
    std::size_t end = begin + 1;
    next_begin = begin + 1;
    while (end < shifts.size() && motion.to_s - motion.from_s < kCheckBaseline_s &&
           shifts[end].from_s == motion.to_s) {
      if (motion.to_s - motion.from_s < kCheckBaseline_s / 2) next_begin = end;
      motion.to_s = shifts[end].to_s;
      motion.shift += shifts[end].shift;
      ++end;
    }
    const double length_s = motion.to_s - motion.from_s;
    if (length_s >= kCheckBaseline_s && length_s < 3 * kCheckBaseline_s &&
        all_finite(motion.shift)) {
      motions.push_back(motion);
    }
  }
  return motions;
}

double image_range(const std::vector<TimedShift>& shifts) {
  double farthest = 0;
  Vector2<double> place = Vector2<double>::Zero();
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    if (i > 0 && shifts[i].from_s != shifts[i - 1].to_s) place.setZero();
    if (all_finite(shifts[i].shift)) place += shifts[i].shift;
    farthest = std::max(farthest, place.norm());
  }
  return farthest;
}

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

double explained(const MotionFit& fit, const std::array<int, 2>& signs) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (signs[axis] * fit.own[axis].mp >= 0) sum += fit.own[axis].explained();
  }
  return share(sum, fit.mm[0] + fit.mm[1]);
}

double crossed(const MotionFit& fit) {
  return share(fit.other[0].explained() + fit.other[1].explained(), fit.mm[0] + fit.mm[1]);
}

MotionSearch::MotionSearch(const std::vector<TimedShift>& motions, const HeadPath& head,
                           double around_s, double least_times) {
  // The motions overlap by half.
  const double least = std::max(2 * least_times, 0.5 * static_cast<double>(motions.size()));
  const auto score = [](const MotionFit& fit) { return explained(fit, {0, 0}); };
  std::size_t covered = 0;
  for (int steps = kFirstSteps;; steps *= 2) {
    offsets.clear();
    fits.clear();
    for (int i = -steps; i <= steps; ++i) {
      const MotionFit fit = fit_at(motions, head, around_s + i * kStep_s);
      if (static_cast<double>(fit.used) < least) continue;
      offsets.push_back(around_s + i * kStep_s);
      fits.push_back(fit);
    }
    const std::size_t at = best(score);
    sure = at > 0 && at + 1 < fits.size() && score(fits[at]) >= kWell;
    if (sure || fits.size() == covered) return;
    covered = fits.size();
  }
}

}  // namespace alidade

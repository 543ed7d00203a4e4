#include "edge_app/check/motion_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/model/angle.h"
#include "edge_app/pipeline/stale_repeats.h"

namespace alidade {
namespace {

constexpr double kBaseline = 0.3;         // s
constexpr double kSearch = 1;             // s, to both sides: as calibrate() searches first
constexpr double kStep = 0.01;            // s
constexpr double kMovedPx = 2;            // rms over kBaseline
constexpr double kLeastTimes = 8;         // baselines without overlap
constexpr double kExplained = 0.8;        // of an axis's motion
constexpr double kUnlike = 0.8;           // what the other sign may explain, of what this one does
constexpr double kLargestGap = 0.5;       // s between samples: TelemetryLimits
constexpr double kLeastHeadRange = 1e-3;  // rad; less turns no picture visibly

// Angles without turns, at the middles of the samples' intervals.
class HeadPath {
 public:
  explicit HeadPath(const std::vector<PanTiltSample>& samples) {
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

  [[nodiscard]] bool at(double time_s, Vector2<double>* angle) const {
    const auto next = std::upper_bound(times_.begin(), times_.end(), time_s);
    if (next == times_.begin() || next == times_.end()) return false;
    const auto i = static_cast<std::size_t>(next - times_.begin());
    const double gap_s = times_[i] - times_[i - 1];
    if (gap_s > kLargestGap) return false;
    const double share = (time_s - times_[i - 1]) / gap_s;
    *angle = (1 - share) * angles_[i - 1] + share * angles_[i];
    return true;
  }

  [[nodiscard]] std::size_t samples() const { return times_.size(); }

  [[nodiscard]] double range() const {
    Vector2<double> least = Vector2<double>::Zero();
    Vector2<double> most = Vector2<double>::Zero();
    for (const Vector2<double>& angle : angles_) {
      least = least.cwiseMin(angle - angles_.front());
      most = most.cwiseMax(angle - angles_.front());
    }
    return (most - least).maxCoeff();
  }

 private:
  std::vector<double> times_;
  std::vector<Vector2<double>> angles_;
};

// Motions over the baseline, along shifts that join; each begins where the one before began its second half, so that
// about half of them are independent.
std::vector<TimedShift> over_baseline(const std::vector<TimedShift>& shifts) {
  std::vector<TimedShift> motions;
  std::size_t next_begin = 0;
  for (std::size_t begin = 0; begin < shifts.size(); begin = next_begin) {
    TimedShift motion = shifts[begin];
    std::size_t end = begin + 1;
    next_begin = begin + 1;
    while (end < shifts.size() && motion.to_s - motion.from_s < kBaseline &&
           shifts[end].from_s == motion.to_s) {
      if (motion.to_s - motion.from_s < kBaseline / 2) next_begin = end;
      motion.to_s = shifts[end].to_s;
      motion.shift += shifts[end].shift;
      ++end;
    }
    const double length_s = motion.to_s - motion.from_s;
    if (length_s >= kBaseline && length_s < 3 * kBaseline && all_finite(motion.shift)) {
      motions.push_back(motion);
    }
  }
  return motions;
}

// Sums of one axis of the image with one axis of the head, over all motions.
struct Sums {
  double mp = 0;
  double pp = 0;
  [[nodiscard]] double explained() const { return pp > 0 ? mp * mp / pp : 0; }
};

struct Fit {
  std::array<Sums, 2> own;    // u with pan, v with tilt
  std::array<Sums, 2> other;  // u with tilt, v with pan
  std::array<double, 2> mm{};
  std::size_t used = 0;
};

Fit fit(const std::vector<TimedShift>& motions, const HeadPath& head, double offset_s) {
  Fit fit;
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

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

// What is explained if the axes have these signs; 0: either, whichever fits.
double explained(const Fit& fit, const std::array<int, 2>& signs) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (signs[axis] * fit.own[axis].mp >= 0) sum += fit.own[axis].explained();
  }
  return share(sum, fit.mm[0] + fit.mm[1]);
}

struct Search {
  std::vector<double> offsets;
  std::vector<Fit> fits;

  // Index of the best; the first of equals.
  template <typename Score>
  [[nodiscard]] std::size_t best(const Score& score) const {
    std::size_t at = 0;
    for (std::size_t i = 1; i < fits.size(); ++i) {
      if (score(fits[i]) > score(fits[at])) at = i;
    }
    return at;
  }
};

AxisVerdict judge_axis(const Search& search, std::size_t best, std::size_t axis) {
  const Fit& fit = search.fits[best];
  const Sums& sums = fit.own[axis];
  const auto used = static_cast<double>(std::max<std::size_t>(fit.used, 1));
  if (std::sqrt(fit.mm[axis] / used) < kMovedPx) return AxisVerdict::kNotMoved;
  if (share(sums.explained(), fit.mm[axis]) < kExplained) return AxisVerdict::kUnclear;
  const int sign = sums.mp > 0 ? 1 : -1;
  std::array<int, 2> reversed = {0, 0};
  reversed[axis] = -sign;
  // Beside another axis that fixes the offset, an even swing of this one may be told after all.
  const auto score = [&](const Fit& at) { return explained(at, reversed); };
  const Fit& other = search.fits[search.best(score)];
  const bool fits_reversed = other.own[axis].mp * sign < 0 &&
                             share(other.own[axis].explained(), other.mm[axis]) >
                                 kUnlike * share(sums.explained(), fit.mm[axis]) &&
                             score(other) > kUnlike * explained(fit, {0, 0});
  if (fits_reversed) return AxisVerdict::kUnclear;
  return sign > 0 ? AxisVerdict::kRight : AxisVerdict::kReversed;
}

bool is_told(AxisVerdict verdict) {
  return verdict == AxisVerdict::kRight || verdict == AxisVerdict::kReversed;
}

void judge_signs(MotionReport* report, const MotionNeeds& needs) {
  const std::string where = "pan/tilt " + needs.source + ": ";
  const bool pan = report->pan == AxisVerdict::kReversed;
  const bool tilt = report->tilt == AxisVerdict::kReversed;
  if (report->quarter_turn) {
    add_problem(&report->findings,
                where +
                    "pan moves the picture up and down, and tilt to the side: it is turned by a "
                    "quarter; set the camera's picture upright");
  } else if (pan && tilt) {
    add_problem(
        &report->findings,
        where + "pan and tilt are both reversed against the picture, as if it were upside down; " +
            needs.turn_picture);
  } else if (pan) {
    add_problem(&report->findings, where +
                                       "pan is reversed: the picture shows that the camera turns "
                                       "the other way; " +
                                       needs.reverse_pan);
  } else if (tilt) {
    add_problem(&report->findings, where +
                                       "tilt is reversed: the picture shows that the camera turns "
                                       "the other way; " +
                                       needs.reverse_tilt);
  }
}

// A data sheet's focal length begins a calibration well if it is right to 20 % (examples/alidade.yaml); a calibration's
// is known far better than this check is, some percent.
void judge_scale(MotionReport* report, const MotionNeeds& needs) {
  constexpr double kGuess = 0.2;
  constexpr double kCalibrated = 0.1;
  if (!report->focal_length_px || !(needs.focal_length_px > 0)) return;
  const double factor = *report->focal_length_px / needs.focal_length_px;
  if (std::abs(factor - 1) <= (needs.calibrated ? kCalibrated : kGuess)) return;
  add_problem(
      &report->findings,
      fmt::format("{}: the picture moves as with a focal length of {:.0f} px, {:.2f} times the "
                  "{:.0f} px given; {}",
                  needs.focal_length_from, *report->focal_length_px, factor, needs.focal_length_px,
                  needs.calibrated ? "has the zoom changed? Calibrate again"
                                   : fmt::format("set camera.focal_length_px: {:.0f}",
                                                 *report->focal_length_px)));
}

// The search's steps and the samples' age leave some 20 ms open; three times that is another link's delay.
void judge_offset(MotionReport* report, const MotionNeeds& needs) {
  constexpr double kFar = 0.06;  // s
  if (!needs.calibrated || !report->clock_offset_s ||
      std::abs(*report->clock_offset_s - needs.clock_offset_s) < kFar) {
    return;
  }
  add_advice(
      &report->findings,
      fmt::format("{}: its clock offset is {:.0f} ms, but picture and telemetry fit with about "
                  "{:.0f} ms; another link or codec delays differently: calibrate again",
                  needs.focal_length_from, 1e3 * needs.clock_offset_s,
                  1e3 * *report->clock_offset_s));
}

// How far the image's centre came from where it began, px, along shifts that join.
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

// A mount that shakes moves the picture by some pixels, too; a quarter of its width is no shaking.
void judge_presence(MotionReport* report, double image_px, double head_rad,
                    const MotionNeeds& needs) {
  const double much_px = 0.25 * needs.image_width_px;
  const double head_px = head_rad * needs.focal_length_px;
  if (!(much_px > 0)) return;
  if (head_rad == 0 && image_px > much_px) {
    add_problem(
        &report->findings,
        fmt::format("pan/tilt {}: always the same angles, while the picture moved by {:.0f} px; "
                    "the device reports no position of this camera: look at its address, "
                    "camera number and permissions",
                    needs.source, image_px));
  } else if (!report->image_moved && head_px > much_px) {
    add_problem(
        &report->findings,
        fmt::format("video {}: the picture stands still, while the head turned by {:.0f} px; it "
                    "is frozen, or another camera's",
                    needs.video, head_px));
  }
}

const char* to_string(AxisVerdict verdict) {
  switch (verdict) {
    case AxisVerdict::kNotMoved:
      return "did not move enough to tell";
    case AxisVerdict::kUnclear:
      return "sign unclear: turn it to and fro at changing speed";
    case AxisVerdict::kRight:
      return "sign right";
    case AxisVerdict::kReversed:
      return "sign REVERSED";
  }
  return "";
}

}  // namespace

MotionReport check_motion(const std::vector<TimedShift>& shifts,
                          const std::vector<PanTiltSample>& samples, const MotionNeeds& needs) {
  MotionReport report;
  const std::vector<TimedShift> motions = over_baseline(shifts);
  const HeadPath head(samples);
  if (head.samples() < 2) return report;
  report.head_moved = head.range() > kLeastHeadRange;
  double squares = 0;
  for (const TimedShift& motion : motions) squares += motion.shift.squaredNorm();
  // Motions overlap by half.
  const bool enough = 0.5 * static_cast<double>(motions.size()) >= kLeastTimes;
  report.image_moved =
      !motions.empty() && std::sqrt(squares / static_cast<double>(motions.size())) >= kMovedPx;
  if (!enough) return report;
  if (!report.image_moved || !report.head_moved) {
    judge_presence(&report, image_range(shifts), head.range(), needs);
    return report;
  }

  Search search;
  for (double offset = -kSearch; offset <= kSearch + kStep / 2; offset += kStep) {
    Fit at = fit(motions, head, needs.clock_offset_s + offset);
    if (0.5 * static_cast<double>(at.used) < kLeastTimes) continue;
    search.offsets.push_back(needs.clock_offset_s + offset);
    search.fits.push_back(at);
  }
  if (search.fits.empty()) return report;
  const auto score = [](const Fit& at) { return explained(at, {0, 0}); };
  const std::size_t best = search.best(score);
  const auto crossed = [](const Fit& at) {
    return share(at.other[0].explained() + at.other[1].explained(), at.mm[0] + at.mm[1]);
  };
  report.explained = score(search.fits[best]);
  const double turned = crossed(search.fits[search.best(crossed)]);
  if (turned >= kExplained && report.explained < kUnlike * turned) {
    report.quarter_turn = true;
    report.pan = report.tilt = AxisVerdict::kUnclear;
    judge_signs(&report, needs);
    return report;
  }
  report.pan = judge_axis(search, best, 0);
  report.tilt = judge_axis(search, best, 1);
  double mp = 0;
  double pp = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (!is_told(axis == 0 ? report.pan : report.tilt)) continue;
    mp += std::abs(search.fits[best].own[axis].mp);
    pp += search.fits[best].own[axis].pp;
  }
  if (pp > 0) {
    report.focal_length_px = mp / pp;
    report.clock_offset_s = search.offsets[best];
  }
  judge_signs(&report, needs);
  judge_scale(&report, needs);
  judge_offset(&report, needs);
  return report;
}

ReportLines describe(const MotionReport& report) {
  if (!report.image_moved || !report.head_moved) {
    const char* text =
        report.head_moved
            ? "the head turned, but no motion was seen in the picture: signs are not checked"
        : report.image_moved
            ? "the picture moves, but not the head: signs are not checked"
            : "the camera did not move: turn it during the check to have signs checked";
    return {{"motion", text}};
  }
  std::string text = fmt::format("pan {}, tilt {}", to_string(report.pan), to_string(report.tilt));
  if (report.focal_length_px) {
    text += fmt::format("; focal length about {:.0f} px, clock offset about {:.0f} ms",
                        *report.focal_length_px, 1e3 * *report.clock_offset_s);
  }
  return {{"motion", text}};
}

}  // namespace alidade

#include "edge_app/check/motion_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/model/recording_needs.h"
#include "edge_app/check/motion_fit.h"

namespace alidade {
namespace {

constexpr double kExplained = 0.8;  // of an axis's motion
// Of what this sign explains: the most that the other sign may explain.
constexpr double kUnlike = 0.8;
constexpr double kLeastHeadRange_rad = 1e-3;  // less does not move an image visibly

AxisVerdict judge_axis(const MotionSearch& search, std::size_t best, std::size_t axis) {
  const MotionFit& fit = search.fits[best];
  const MotionSums& sums = fit.own[axis];
  const auto used = static_cast<double>(std::max<std::size_t>(fit.used, 1));
  if (std::sqrt(fit.mm[axis] / used) < kCheckMotionLeast_px) return AxisVerdict::kNotMoved;
  if (share(sums.explained(), fit.mm[axis]) < kExplained) return AxisVerdict::kUnclear;
  const int sign = sums.mp > 0 ? 1 : -1;
  std::array<int, 2> reversed = {0, 0};
  reversed[axis] = -sign;
  // If the other axis fixes the offset, the sign of an even swing can be known after all.
  const auto score = [&](const MotionFit& at) { return explained(at, reversed); };
  const MotionFit& other = search.fits[search.best(score)];
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
                    "pan moves the picture up and down, and tilt moves it sideways: it is turned "
                    "by 90 degrees; set the camera's picture upright");
  } else if (pan && tilt) {
    add_problem(
        &report->findings,
        where + "pan and tilt are both reversed against the picture, as if it were upside down; " +
            needs.turn_image);
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

// A data sheet's focal length is good enough to start a calibration if it is right to 20 %
// (examples/alidade.yaml). A calibration's is known far better than this check measures, which is
// to some percent.
void judge_scale(MotionReport* report, const MotionNeeds& needs) {
  constexpr double kGuess = 0.2;
  constexpr double kCalibrated = 0.1;
  if (!report->focal_length_px || !(needs.focal_length_px > 0)) return;
  const double nearest_px = std::clamp(*report->focal_length_px, needs.focal_length_px,
                                       needs.tele_px.value_or(needs.focal_length_px));
  const double factor = *report->focal_length_px / nearest_px;
  if (std::abs(factor - 1) <= (needs.calibrated ? kCalibrated : kGuess)) return;
  if (needs.tele_px) {
    add_problem(&report->findings,
                fmt::format("{}: the picture moves as if the focal length were {:.0f} px, but "
                            "{:.0f} to {:.0f} px are given; correct camera.focal_length_px: wide "
                            "and tele are the zoom's two ends, in pixels of this picture",
                            needs.focal_length_from, *report->focal_length_px,
                            needs.focal_length_px, *needs.tele_px));
    return;
  }
  add_problem(
      &report->findings,
      fmt::format("{}: the picture moves as if the focal length were {:.0f} px, {:.2f} times the "
                  "{:.0f} px given; {}",
                  needs.focal_length_from, *report->focal_length_px, factor, needs.focal_length_px,
                  needs.calibrated ? "has the zoom changed? Calibrate again"
                                   : fmt::format("set camera.focal_length_px: {:.0f}",
                                                 *report->focal_length_px)));
}

// The overlap of the motions halves their number.
AxisFocalLength focal_length_by(const MotionFit& fit, std::size_t axis) {
  const MotionSums& sums = fit.own[axis];
  const double left = std::max(0.0, fit.mm[axis] - sums.explained()) /
                      static_cast<double>(std::max<std::size_t>(fit.used, 1));
  return {std::abs(sums.mp) / sums.pp, std::sqrt(2 * left / sums.pp)};
}

// Each axis by itself gives a focal length, and there is one: if they differ, angles of one axis
// are told in another scale. calibrate() refuses a difference of 2 %; this check is good to some
// percent.
void judge_axes(MotionReport* report, const MotionNeeds& needs) {
  constexpr double kMost = 0.04;
  constexpr double kSigmas = 4;
  if (!report->by_axis) return;
  const auto& [pan, tilt] = *report->by_axis;
  const double ratio = tilt.value_px / pan.value_px;
  const double sigma =
      ratio * std::hypot(pan.sigma_px / pan.value_px, tilt.sigma_px / tilt.value_px);
  if (std::abs(ratio - 1) < std::max(kMost, kSigmas * sigma)) return;
  const bool by_pan = ratio > 1;
  add_problem(
      &report->findings,
      fmt::format(
          "pan/tilt {}: pan and tilt differ in scale: by pan's angles the focal length is "
          "{:.0f} px, by tilt's {:.0f} px; either {}'s angles are too large, by a factor of "
          "{:.3f} +- {:.3f}, or {}'s too small; {}",
          needs.source, pan.value_px, tilt.value_px, by_pan ? "pan" : "tilt",
          by_pan ? ratio : 1 / ratio, by_pan ? sigma : sigma / (ratio * ratio),
          by_pan ? "tilt" : "pan", needs.scales));
}

// The search's steps and the samples' age leave some 20 ms open. Three times that is another link's
// delay.
void judge_offset(MotionReport* report, const MotionNeeds& needs) {
  constexpr double kFar_s = 0.06;
  if (!needs.calibrated || !report->clock_offset_s ||
      std::abs(*report->clock_offset_s - needs.clock_offset_s) < kFar_s) {
    return;
  }
  add_advice(
      &report->findings,
      fmt::format("{}: its clock offset is {:.0f} ms, but picture and telemetry fit best at about "
                  "{:.0f} ms; another link or codec has another delay: calibrate again",
                  needs.focal_length_from, 1e3 * needs.clock_offset_s,
                  1e3 * *report->clock_offset_s));
}

// A shaking mount moves the image by some pixels, too, but not by a quarter of its width.
void judge_presence(MotionReport* report, double image_px, double head_rad,
                    const MotionNeeds& needs) {
  const double much_px = 0.25 * needs.image_width_px;
  const double head_px = head_rad * needs.focal_length_px;
  if (!(much_px > 0)) return;
  if (head_rad == 0 && image_px > much_px) {
    add_problem(&report->findings,
                fmt::format("pan/tilt {}: the angles never change, although the picture moved by "
                            "{:.0f} px; the device does not report this camera's position: check "
                            "its address, camera number and permissions",
                            needs.source, image_px));
  } else if (!report->image_moved && head_px > much_px) {
    add_problem(&report->findings,
                fmt::format("video {}: the picture does not move, although the head turned by "
                            "{:.0f} px; it is frozen, or comes from another camera",
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
      return "sign correct";
    case AxisVerdict::kReversed:
      return "sign REVERSED";
    case AxisVerdict::kNotJudged:
      return "sign not judged";
  }
  return "";
}

}  // namespace

MotionReport check_measured_motion(const std::vector<TimedShift>& shifts,
                                   const std::vector<PanTiltSample>& samples,
                                   const MotionNeeds& needs) {
  MotionReport report;
  const std::vector<TimedShift> motions = over_baseline(shifts);
  const HeadPath head(samples);
  if (head.samples() < 2) return report;
  report.head_moved = head.range() > kLeastHeadRange_rad;
  double squares = 0;
  for (const TimedShift& motion : motions) squares += motion.shift.squaredNorm();
  // The motions overlap by half.
  const bool enough = 0.5 * static_cast<double>(motions.size()) >= kCheckBaselinesLeast;
  report.image_moved =
      !motions.empty() &&
      std::sqrt(squares / static_cast<double>(motions.size())) >= kCheckMotionLeast_px;
  if (!enough) return report;
  if (!report.image_moved || !report.head_moved) {
    judge_presence(&report, image_range(shifts), head.range(), needs);
    return report;
  }

  if (!needs.not_judged.empty()) {
    report.not_judged = needs.not_judged;
    report.pan = report.tilt = AxisVerdict::kNotJudged;
    return report;
  }
  const MotionSearch search(motions, head, needs.clock_offset_s, kCheckBaselinesLeast);
  if (search.fits.empty()) return report;
  const auto score = [](const MotionFit& at) { return explained(at, {0, 0}); };
  const std::size_t best = search.best(score);
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
  // At a wrong clock offset the head may look reversed by chance.
  const bool doubtful =
      !search.sure || report.pan == AxisVerdict::kUnclear || report.tilt == AxisVerdict::kUnclear;
  for (AxisVerdict* verdict : {&report.pan, &report.tilt}) {
    if (doubtful && *verdict == AxisVerdict::kReversed) *verdict = AxisVerdict::kUnclear;
  }
  double mp = 0;
  double pp = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (!is_told(axis == 0 ? report.pan : report.tilt)) continue;
    mp += std::abs(search.fits[best].own[axis].mp);
    pp += search.fits[best].own[axis].pp;
  }
  if (pp > 0 && search.sure) {
    report.focal_length_px = mp / pp;
    report.clock_offset_s = search.offsets[best];
    if (is_told(report.pan) && is_told(report.tilt)) {
      report.by_axis = {focal_length_by(search.fits[best], 0),
                        focal_length_by(search.fits[best], 1)};
    }
  }
  judge_signs(&report, needs);
  judge_axes(&report, needs);
  judge_scale(&report, needs);
  judge_offset(&report, needs);
  return report;
}

ReportLines describe(const MotionReport& report) {
  if (!report.image_moved || !report.head_moved) {
    std::string text =
        report.head_moved
            ? "the head turned, but no motion was seen in the picture: signs are not checked"
        : report.image_moved
            ? "the picture moves, but not the head: signs are not checked"
            : fmt::format(
                  "the camera did not move: turn it to and fro for {:g} s or more during "
                  "the check, so that the picture moves by {:g} px or more in {:g} s, to "
                  "have signs checked",
                  kCheckBaselinesLeast * kCheckBaseline_s, kCheckMotionLeast_px, kCheckBaseline_s);
    return {{"motion", std::move(text)}};
  }
  if (!report.not_judged.empty()) {
    return {{"motion", "signs are not judged: " + report.not_judged}};
  }
  std::string text = fmt::format("pan {}, tilt {}", to_string(report.pan), to_string(report.tilt));
  if (report.focal_length_px) {
    text += fmt::format("; focal length about {:.0f} px, clock offset about {} ms",
                        *report.focal_length_px, rounded_text(1e3 * *report.clock_offset_s, 0));
  }
  return {{"motion", text}};
}

}  // namespace alidade

#pragma once
// Checks roughly, from the image's motion and the telemetry's, whether pan and tilt have the right
// signs, and which focal length and clock offset fit. The clock offset is the one that explains
// most of the image's motion (motion_fit.h). A sign is stated only if the axis moved the image by 2
// px rms over 0.3 s (the tracker errs by 0.2 px) in eight baselines or more, if this sign explains
// at least 80 % of this motion, and if with the other sign no offset explains 4/5 as much.
// Reasons and the other rules: docs/derivations.md.
// Good to some percent. Radians, seconds, px. Pure; allocates.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/check/finding.h"
#include "edge_app/check/motion_fit.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct MotionNeeds {
  std::string source;             // of pan and tilt
  std::string video;              // of the image
  int image_width_px = 0;         // 0: unknown
  double focal_length_px = 0;     // 0: unknown; of a zoom without calibration: the wide end's
  std::optional<double> tele_px;  // of such a zoom: the tele end's
  std::string focal_length_from;  // where focal_length_px comes from, for people
  bool calibrated = false;
  double clock_offset_s = 0;  // of the calibration, else 0
  // How to reverse a sign in the configuration: "set pan_tilt.tilt_positive: down".
  std::string reverse_pan;
  std::string reverse_tilt;
  std::string turn_image;  // by 180 degrees
  // How the scale of an axis's angles is set: "pan_tilt.pan_range_deg and tilt_range_deg".
  std::string scales;
  std::string not_judged;  // why image and head cannot be compared; empty: they can
};

enum class AxisVerdict {
  kNotMoved,  // too little to judge
  kUnclear,   // moved, but image and head do not agree well enough
  kRight,
  kReversed,
  kNotJudged  // the image's times cannot be used
};

struct AxisFocalLength {
  double value_px = 0;
  double sigma_px = 0;
};

struct MotionReport {
  AxisVerdict pan = AxisVerdict::kNotMoved;
  AxisVerdict tilt = AxisVerdict::kNotMoved;
  bool image_moved = false;
  bool head_moved = false;
  bool quarter_turn = false;  // pan moves the image vertically, tilt horizontally
  // px, from the axes whose sign is stated; set if the search is sure.
  std::optional<double> focal_length_px;
  // px, from pan alone and from tilt alone, with sigmas; set if both signs are stated.
  std::optional<std::array<AxisFocalLength, 2>> by_axis;
  std::optional<double> clock_offset_s;  // known to about 20 ms
  double explained = 0;                  // share of the image's motion
  std::string not_judged;                // as in MotionNeeds
  Findings findings;
};

// shifts, samples: in order of time. samples: without stale repeats.
[[nodiscard]] MotionReport check_measured_motion(const std::vector<TimedShift>& shifts,
                                                 const std::vector<PanTiltSample>& samples,
                                                 const MotionNeeds& needs);

[[nodiscard]] ReportLines describe(const MotionReport& report);

}  // namespace alidade

#pragma once
// Whether pan and tilt turn the image the way they say: signs, focal length and clock offset, roughly, from the
// image's motion against the telemetry's.
//
// The clock offset is where most of the image's motion is explained (motion_fit.h), with each combination of signs by
// itself. A sign is told only with evidence:
//   the axis moved the image by 2 px rms over those 0.3 s (the tracker errs by a tenth of that),
//   in eight such times or more, of which
//   at least 80 % is explained with this sign, and no offset searched explains 4/5 of that with the other:
//   an even swing fits half a period later as well with the sign reversed, and tells nothing;
// and that an axis is reversed, only where the search is sure (MotionSearch) and the other axis is understood if it moved.
// Where the image's times cannot be believed (needs.no_times), nothing that needs them is judged.
// Image motion that follows the other axis better than its own is an image that is turned by a quarter.
// An image that moves by a quarter of its width while the head reports one angle, or stands still while the head reports
// as much, is not of this head, or the head does not measure.
// Good to some percent. Radians, seconds, px. Pure; allocates.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/check/finding.h"
#include "edge_app/check/motion_fit.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct MotionNeeds {
  std::string source;          // of pan and tilt
  std::string video;           // of the image
  int image_width_px = 0;      // 0: unknown
  double focal_length_px = 0;  // 0: unknown
  std::string focal_length_from;
  bool calibrated = false;
  double clock_offset_s = 0;  // of the calibration, else 0
  // What turns a sign where it is configured: "set pan_tilt.tilt_positive: down".
  std::string reverse_pan;
  std::string reverse_tilt;
  std::string turn_image;  // by 180 degrees
  std::string no_times;    // why the image's times are none; empty: they can be believed
};

enum class AxisVerdict {
  kNotMoved,  // too little to tell
  kUnclear,   // moved, but the two do not agree enough
  kRight,
  kReversed,
  kNotJudged  // the image has no times that can be believed
};

struct MotionReport {
  AxisVerdict pan = AxisVerdict::kNotMoved;
  AxisVerdict tilt = AxisVerdict::kNotMoved;
  bool image_moved = false;
  bool head_moved = false;
  bool quarter_turn = false;  // pan moves the image up or down, tilt to the side
  std::optional<double>
      focal_length_px;                   // of the axes whose sign is told, where the search is sure
  std::optional<double> clock_offset_s;  // known to some 20 ms
  double explained = 0;                  // share of the image's motion
  std::string not_judged;                // why, where the image's times are none
  Findings findings;
};

// shifts and samples in order of time; samples without stale repeats.
[[nodiscard]] MotionReport check_motion(const std::vector<TimedShift>& shifts,
                                        const std::vector<PanTiltSample>& samples,
                                        const MotionNeeds& needs);

[[nodiscard]] ReportLines describe(const MotionReport& report);

}  // namespace alidade

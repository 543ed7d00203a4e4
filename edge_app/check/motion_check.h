#pragma once
// Whether pan and tilt turn the picture the way they say: signs, focal length and clock offset, roughly, from the
// image's motion against the telemetry's.
//
// Over about 0.3 s the image's centre moves by (-f cos(tilt) dpan, f dtilt): the scene to the left when the camera turns
// right, down when it turns up. With m the motions seen in the video, px, p those predicted with f = 1 at a clock offset d:
//   s_a(d)   = sum(m_a p_a) / sum(p_a^2)              scale of axis a: f, or -f where its sign is wrong
//   c(d)     = sum over axes of sum(m_a p_a)^2 / sum(p_a^2), over sum(m^2)    share of the motion that is explained
// d is where c is largest, with each combination of signs by itself. A sign is told only with evidence:
//   the axis moved the image by 2 px rms over those 0.3 s (the tracker errs by a tenth of that),
//   in eight such times or more, of which
//   at least 80 % is explained with this sign, and no offset searched explains 4/5 of that with the other:
//   an even swing fits half a period later as well with the sign reversed, and tells nothing.
// Image motion that follows the other axis better than its own is a picture that is turned by a quarter.
// A picture that moves by a quarter of its width while the head reports one angle, or stands still while the head reports
// as much, is not of this head, or the head does not measure.
// Nominal axes and small distortion at the centre: good to some percent. Radians, seconds, px. Pure; allocates.

#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"
#include "edge_app/check/finding.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// The image's motion between two frames that follow each other.
struct TimedShift {
  double from_s = 0;  // image clock
  double to_s = 0;
  Vector2<double> shift = Vector2<double>::Zero();  // px
};

struct MotionNeeds {
  std::string source;          // of pan and tilt
  std::string video;           // of the picture
  int image_width_px = 0;      // 0: unknown
  double focal_length_px = 0;  // 0: unknown
  std::string focal_length_from;
  bool calibrated = false;
  double clock_offset_s = 0;  // of the calibration, else 0
  // What turns a sign where it is configured: "set pan_tilt.tilt_positive: down".
  std::string reverse_pan;
  std::string reverse_tilt;
  std::string turn_picture;  // by 180 degrees
};

enum class AxisVerdict {
  kNotMoved,  // too little to tell
  kUnclear,   // moved, but the two do not agree enough
  kRight,
  kReversed
};

struct MotionReport {
  AxisVerdict pan = AxisVerdict::kNotMoved;
  AxisVerdict tilt = AxisVerdict::kNotMoved;
  bool image_moved = false;
  bool head_moved = false;
  bool quarter_turn = false;              // pan moves the image up or down, tilt to the side
  std::optional<double> focal_length_px;  // of the axes whose sign is told
  std::optional<double> clock_offset_s;   // known to some 20 ms
  double explained = 0;                   // share of the image's motion
  Findings findings;
};

// shifts and samples in order of time; samples without stale repeats.
[[nodiscard]] MotionReport check_motion(const std::vector<TimedShift>& shifts,
                                        const std::vector<PanTiltSample>& samples,
                                        const MotionNeeds& needs);

[[nodiscard]] ReportLines describe(const MotionReport& report);

}  // namespace alidade

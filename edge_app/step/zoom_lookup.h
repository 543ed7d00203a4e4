#pragma once
// ZoomLookup: which zoom the lens had at a time, from its latest readings, and the calibration that the zoom curve gives for it.
// Between two readings it is interpolated; after the newest a lens that moved moves on, or has stopped: half of the way is the
// standard deviation. Fixed memory; allocates nothing.

#include <array>
#include <cstddef>

#include "core/model/zoom_curve.h"
#include "core/realtime/oe_mode/frame_lens.h"

namespace alidade {

class ZoomLookup {
 public:
  // Telemetry time, s; device units. What is not finite, or not later than before, is left out.
  void add(double time_s, double zoom);

  // Whether the lens stood at this zoom then: the readings about the time are within the tolerance of it.
  [[nodiscard]] bool stands_at(double zoom, double tolerance, double time_s) const;

  // By how much the readings about the time, and the one after them, say that the focal length changed, relatively, as the curve has it:
  // a lens that begins to move has left its zoom by less than a tolerance at first. 0: by nothing, or the curve does not say.
  [[nodiscard]] double change_about(const ZoomCurve& curve, double time_s) const;

  // As PT mode needs it for a frame whose middle row has this telemetry time and whose rows are read out in readout_s. False: no
  // reading, or the curve ends before it.
  [[nodiscard]] bool calibration(const ZoomCurve& curve, double time_s, double readout_s,
                                 Calibration* calibration) const;
  // As OE mode needs it, likewise. tolerance: readings so far apart are of a lens that stands, device units.
  [[nodiscard]] bool lens(const ZoomCurve& curve, double time_s, double readout_s, double tolerance,
                          FrameLens* lens) const;

 private:
  struct Reading {
    double time_s = 0;
    double zoom = 0;
  };
  static constexpr std::size_t kKept = 64;

  // back: 0 is the newest.
  [[nodiscard]] const Reading& reading(std::size_t back) const {
    return readings_[(count_ - 1 - back) % kKept];
  }

  struct Range {
    double low = 0;
    double high = 0;
  };
  // Of the two readings about the time and of the one after them; there is one reading at least.
  [[nodiscard]] Range range_about(double time_s) const;
  // Of the newer of the two readings about the time, or next to it; there is one at least.
  [[nodiscard]] std::size_t newer_of(double time_s) const;

  std::array<Reading, kKept> readings_;
  std::size_t count_ = 0;  // of all
};

// Standard deviation of log f to which landmarks are looked for by a zoom curve while the camera can still calibrate itself at the
// reading: less than 7 px at the border of 1280.
inline constexpr double kSharpFocalLength = 0.01;
// Likewise where it does not: with more the first landmarks do not hold through a turn.
inline constexpr double kRoughFocalLength = 0.05;
// By so much of log f a lens may miss the curve's ends.
inline constexpr double kBeyondEnds = 0.02;
// As the curve has it at the reading where it has this focal length, px: for a lens whose reading is wrong. moves is set. Just beyond
// an end: as there. False: the curve does not come there.
[[nodiscard]] bool lens_of_focal_length(const ZoomCurve& curve, double focal_length,
                                        FrameLens* lens);

}  // namespace alidade

#pragma once
// ZoomLookup: the lens's zoom at any time, from the latest readings, and the zoom curve's
// calibration at this zoom. Between two readings the zoom is interpolated. After the newest reading
// a moving lens is taken to go on at its rate; as it may have stopped, sigma includes half of the
// way since then.
// Fixed memory; allocates nothing.

#include <array>
#include <cstddef>

#include "core/model/lens/zoom_curve.h"
#include "core/realtime/lens/frame_lens.h"

namespace alidade {

class ZoomLookup {
 public:
  // s, telemetry time; device units. Ignored if not finite, or not later than the reading before.
  void add(double time_s, double zoom);

  // Whether the lens stood at this zoom at that time: both readings around the time are within the
  // tolerance (device units). False without readings.
  [[nodiscard]] bool stands_at(double zoom, double tolerance, double time_s) const;

  // Span of log f, by the curve, over the two readings around the time and the reading after them;
  // >= 0. Shows a lens that begins to move, as its first readings are still within the tolerance.
  // 0: no change, no reading, or the curve does not reach the readings.
  [[nodiscard]] double change_about(const ZoomCurve& curve, double time_s) const;

  // The calibration for PT mode, for a frame with this telemetry time of its middle row, whose rows
  // are read out in readout_s. False: there is no reading, or the curve does not reach it; the
  // output is then not to be used, here and below.
  [[nodiscard]] bool calibration(const ZoomCurve& curve, double time_s, double readout_s,
                                 Calibration* calibration) const;
  // The lens for OE mode, likewise. tolerance: device units; readings that are no further apart are
  // of a resting lens.
  [[nodiscard]] bool lens(const ZoomCurve& curve, double time_s, double readout_s, double tolerance,
                          FrameLens* lens) const;

 private:
  struct Reading {
    double time_s = 0;
    double zoom = 0;
  };
  static constexpr std::size_t kKept = 64;

  // back: 0 is the newest reading.
  [[nodiscard]] const Reading& reading(std::size_t back) const {
    return readings_[(count_ - 1 - back) % kKept];
  }

  struct Range {
    double low = 0;
    double high = 0;
  };
  // Range of the two readings around the time and the one after them. Needs at least one reading.
  [[nodiscard]] Range range_about(double time_s) const;
  // Index of the newer of the two readings around the time, or of the nearest. Needs at least one
  // reading.
  [[nodiscard]] std::size_t newer_of(double time_s) const;

  std::array<Reading, kKept> readings_;
  std::size_t count_ = 0;  // of all readings ever added
};

// Up to this sigma of log f a zoom curve is good enough to begin landmarks if the camera could
// calibrate itself instead: less than 7 px at the border of an image 1280 px wide.
inline constexpr double kSharpFocalLength = 0.01;
// The same if the camera cannot calibrate itself. Beyond it the first landmarks do not hold through
// a turn.
inline constexpr double kRoughFocalLength = 0.05;
// log f; so far a lens may lie beyond the ends of the curve.
inline constexpr double kBeyondEnds = 0.02;
// The curve's lens with this focal length, px, for a lens whose reading is wrong. `moves` is set,
// the rate is 0 with a large sigma. Up to kBeyondEnds beyond an end: the lens at that end. False:
// the curve is empty, does not reach it, or is not monotone; *lens is then not to be used.
[[nodiscard]] bool lens_of_focal_length(const ZoomCurve& curve, double focal_length,
                                        FrameLens* lens);

}  // namespace alidade

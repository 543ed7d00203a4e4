#pragma once
// AxisPairing: makes samples from readings of single axes: pan, tilt, pan, tilt, ...
//
// Pan and tilt of a sample belong to the moment of the tilt reading. The pan is interpolated
// between the readings before and after the tilt. Let t0, t2 be the middles and h0, h2 the half
// widths of the pan readings' intervals, t1 and h1 the same of the tilt reading's interval, and
// w = (t1 - t0) / (t2 - t0):
//   pan = pan0 + w wrap(pan2 - pan0), interval t1 -+ max(h1, (1 - w) h0 + w h2).
// Without interpolation pan and tilt would be half a cycle apart: 15 ms at 34 Hz, which no clock
// offset can repair. The price: a sample comes half a cycle later. If both axes repeat their
// previous reading (head at rest, or no new measurement in the device), the sample repeats too. No
// I/O, no allocation; radians, and seconds of the host's CLOCK_MONOTONIC.

#include <optional>

namespace alidade {

struct AxisReading {
  double earliest_s = 0;
  double latest_s = 0;
  double angle_rad = 0;
};

struct PairedReading {
  double earliest_s = 0;
  double latest_s = 0;
  double pan_rad = 0;  // in [-pi, pi)
  double tilt_rad = 0;
};

class AxisPairing {
 public:
  // To be called at a gap. Readings before it are not interpolated with readings after it.
  void reset();

  // Readings must come in order of time. A pan that follows a tilt completes that tilt's sample,
  // which is returned; nullopt otherwise.
  std::optional<PairedReading> add_pan(const AxisReading& pan);
  void add_tilt(const AxisReading& tilt);

 private:
  std::optional<AxisReading> pan_;
  std::optional<AxisReading> tilt_;  // read since pan_
  std::optional<double> last_tilt_;  // rad; read before pan_
  bool pan_repeats_ = false;         // pan_ repeats the pan before it
  bool tilt_repeats_ = false;
};

[[nodiscard]] double wrap_to_half_turn(double angle_rad);  // to [-pi, pi)

}  // namespace alidade

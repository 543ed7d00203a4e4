#pragma once
// AxisPairing: makes samples of readings that give one axis at a time, pan, tilt, pan, tilt, ...
//
// Pan and tilt of a sample belong to one moment, that of the tilt reading: the pan is interpolated
// between the readings before and after it. With the middles t0 and t2 and half widths h0 and h2 of
// the pan readings' intervals and t1, h1 of the tilt's, w = (t1 - t0) / (t2 - t0):
//   pan = pan0 + w wrap(pan2 - pan0), interval t1 -+ max(h1, (1 - w) h0 + w h2).
// Without it pan and tilt would be apart by half a cycle: 15 ms at 34 Hz, more than any
// clock offset can repair. The price is that a sample comes half a cycle later. Where both axes repeat
// the reading before, the head is at rest or the device has not measured since: the sample repeats, too.
//
// Pure; radians and seconds; no allocation.

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
  // A gap: what was read before is not interpolated with what comes.
  void reset();

  // Later than all before. A sample comes with the pan after the tilt.
  std::optional<PairedReading> add_pan(const AxisReading& pan);
  void add_tilt(const AxisReading& tilt);

 private:
  std::optional<AxisReading> pan_;
  std::optional<AxisReading> tilt_;  // since that pan
  std::optional<double> last_tilt_;  // rad, before that pan
  bool pan_repeats_ = false;         // the reading before it
  bool tilt_repeats_ = false;
};

[[nodiscard]] double wrap_to_half_turn(double angle_rad);  // into [-pi, pi)

}  // namespace alidade

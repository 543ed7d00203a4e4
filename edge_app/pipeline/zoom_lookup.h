#pragma once
// ZoomLookup: which zoom the lens had at a time, from the last two readings, and the calibration that the zoom curve gives for it.
// Between the two the reading is interpolated; after the newer one a lens that moved moves on, or has stopped: half of the
// way is the standard deviation. Fixed memory; allocates nothing.

#include "core/model/zoom_curve.h"

namespace alidade {

class ZoomLookup {
 public:
  // Telemetry time, s; device units. What is not finite, or not later than before, is left out.
  void add(double time_s, double zoom);

  // As PT mode needs it for a frame whose middle row has this telemetry time and whose rows are read out in readout_s. False: no
  // reading, or the curve ends before it.
  [[nodiscard]] bool calibration(const ZoomCurve& curve, double time_s, double readout_s,
                                 Calibration* calibration) const;

 private:
  struct Reading {
    double time_s = 0;
    double zoom = 0;
  };
  Reading before_;
  Reading newest_;
  int count_ = 0;  // up to 2
};

}  // namespace alidade

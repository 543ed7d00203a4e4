#pragma once
// ZoomReadings: a lens's zoom readings in real time, without their jitter (steady_zoom.h), and the
// zoom at any time (zoom_lookup.h). The owner of the tolerance within which two readings are one
// zoom. Device units. Fixed memory; no allocation. One thread.

#include <optional>

#include "core/model/steady_zoom.h"
#include "core/realtime/lens/zoom_lookup.h"

namespace alidade {

class ZoomReadings {
 public:
  // tolerance: readings no further apart are one zoom. None: found from their jitter.
  explicit ZoomReadings(std::optional<double> tolerance) : steady_(tolerance) {}

  // time_s: s, when it was received; in order. reading: finite. True if zoom() differs from before,
  // by however little.
  bool take(double time_s, double reading);
  // Gives the telemetry time (s) of the reading taken last, for the look-ups below.
  void place(double time_s) {
    if (zoom_) lookup_.add(time_s, *zoom_);
  }
  [[nodiscard]] const std::optional<double>& told() const { return told_; }  // as last reported
  [[nodiscard]] const std::optional<double>& zoom() const { return zoom_; }  // without jitter

  // To be called when a calibration is adopted. If it has no zoom, it counts as made at the present
  // zoom or, without a reading so far, at the first one.
  void note_adoption() { zoom_at_adoption_ = zoom_; }
  // True if the present zoom is the calibration's, to the tolerance, or one of the two is unknown.
  // calibrated: the calibration's zoom; empty: that of note_adoption().
  [[nodiscard]] bool fits(const std::optional<double>& calibrated) const;

  // See ZoomLookup.
  [[nodiscard]] bool stands_at(double zoom, double time_s) const {
    return lookup_.stands_at(zoom, steady_.tolerance(), time_s);
  }
  [[nodiscard]] double change_about(const ZoomCurve& curve, double time_s) const {
    return lookup_.change_about(curve, time_s);
  }
  [[nodiscard]] bool calibration(const ZoomCurve& curve, double time_s, double readout_s,
                                 Calibration* calibration) const {
    return lookup_.calibration(curve, time_s, readout_s, calibration);
  }
  [[nodiscard]] bool lens(const ZoomCurve& curve, double time_s, double readout_s,
                          FrameLens* lens) const {
    return lookup_.lens(curve, time_s, readout_s, steady_.tolerance(), lens);
  }

 private:
  SteadyZoom steady_;
  ZoomLookup lookup_;
  std::optional<double> told_;
  std::optional<double> zoom_;
  std::optional<double> zoom_at_adoption_;
};

}  // namespace alidade

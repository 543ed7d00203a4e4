#pragma once
// PresentZoom: the zoom at which the camera stands, from readings as they come. Jitter is removed
// (steady_zoom.h), and readings that differ for less than zoom_glitch_s are left out. A sample
// without a reading leaves the zoom as it was.
// Seconds of the host's clock. Does not allocate. One thread.

#include <cmath>
#include <optional>

#include "core/model/steady_zoom.h"
#include "edge_app/self_calibration/calibration_schedule.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

class PresentZoom {
 public:
  enum class Change {
    kNone,    // no reading, or another zoom's that may be a glitch
    kSilent,  // no reading for zoom_silence_s, though there were some before
    kJitter,  // the jitter is known now: readings that were taken for other zooms were this one
    kSame,    // a reading of this zoom
    kGlitch,  // a reading of this zoom, after others for less than zoom_glitch_s
    kFirst,   // the first zoom
    kMoved    // another zoom; each reading of a movement is another zoom
  };

  // tolerance: see SteadyZoom.
  PresentZoom(std::optional<double> tolerance, const CalibrationSchedule& schedule)
      : steady_(tolerance), schedule_(schedule) {}

  Change add(const PanTiltSample& sample);
  // After kSame and kGlitch: the first reading is not yet the level of the rest; it is replaced.
  void take_level();

  // Empty until there is one. Device units.
  [[nodiscard]] const std::optional<double>& reading() const { return reading_; }
  // Whether the present zoom is `wanted`; true if one of them is not known.
  [[nodiscard]] bool fits(const std::optional<double>& wanted) const {
    return !reading_ || !wanted || std::abs(*reading_ - *wanted) <= steady_.tolerance();
  }
  // False while the zoom may just pass by this reading.
  [[nodiscard]] bool has_arrived(double now_s) const {
    return !(now_s < changed_s_ + schedule_.zoom_arrives_s);
  }
  // False while frames may still show another zoom. time_s: of the frame.
  [[nodiscard]] bool has_settled(double time_s) const {
    return !(time_s < changed_s_ + schedule_.zoom_settles_s);
  }
  // Device units: sigma of the jitter; readings no further apart than the tolerance are one zoom.
  [[nodiscard]] double sigma() const { return steady_.sigma(); }
  [[nodiscard]] double tolerance() const { return steady_.tolerance(); }

 private:
  SteadyZoom steady_;
  CalibrationSchedule schedule_;
  std::optional<double> reading_;
  double level_ = 0;  // of the last reading
  double changed_s_ = -1e9;
  // s: since when readings differ, after they stood still: a glitch, or a movement.
  std::optional<double> odd_s_;
  double last_s_ = 0;  // s, of the last reading
};

}  // namespace alidade

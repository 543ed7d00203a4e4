#pragma once
// PresentZoom: the zoom at which the camera stands, from readings as they come. Jitter is removed
// (steady_zoom.h), and a reading that differs for less than zoom_glitch_s is left out. One that is
// missing leaves the zoom as it was.
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
    kNone,
    kSilent,  // no reading for zoom_silence_s, though there were some
    kJitter,  // jitter is known now: what were taken for other zooms were this one
    kSame,    // a reading of this zoom
    kGlitch,  // such a reading, behind others
    kFirst,   // the first zoom
    kMoved    // another zoom; each reading of a movement is one
  };

  // tolerance: see SteadyZoom.
  PresentZoom(std::optional<double> tolerance, const CalibrationSchedule& schedule)
      : steady_(tolerance), schedule_(schedule) {}

  Change add(const PanTiltSample& sample);
  // After kSame and kGlitch: the first reading is not yet the level of the rest; it is replaced.
  void take_level();

  // Empty until there is one. Device units.
  [[nodiscard]] const std::optional<double>& reading() const { return reading_; }
  // Whether this is the zoom, as far as both are known.
  [[nodiscard]] bool fits(const std::optional<double>& wanted) const {
    return !reading_ || !wanted || std::abs(*reading_ - *wanted) <= steady_.tolerance();
  }
  // False while the zoom may just pass by ...
  [[nodiscard]] bool has_arrived(double now_s) const {
    return !(now_s < changed_s_ + schedule_.zoom_arrives_s);
  }
  // ... and while frames may still show another zoom.
  [[nodiscard]] bool has_settled(double time_s) const {
    return !(time_s < changed_s_ + schedule_.zoom_settles_s);
  }
  [[nodiscard]] double sigma() const { return steady_.sigma(); }          // device units
  [[nodiscard]] double tolerance() const { return steady_.tolerance(); }  // the same

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

#pragma once
// CalibrationArchive: where the calibrations of one camera are kept, one for each zoom setting, each with its
// map. On disk it is the CalibrationStore. Not for the real-time thread; one thread.

#include <optional>
#include <string>

#include "core/calibration/calibration_text.h"
#include "core/model/calibration.h"
#include "core/realtime/oe_mode/map_state.h"

namespace alidade {

struct StoredCalibration {
  Calibration calibration;
  CalibrationNotes notes;  // written, not read back
  MapState map;
  std::string path;  // of the file; empty: not stored yet
};

class CalibrationArchive {
 public:
  virtual ~CalibrationArchive() = default;

  // The calibration for a zoom: the nearest within the tolerance, else by the zoom curve, else the one without zoom, which
  // holds for any. Without a zoom: the one without, else the only one, or the curve's. Null if there is none. Holds until
  // the next find() or save().
  [[nodiscard]] virtual const StoredCalibration* find(std::optional<double> zoom) const = 0;

  // Device units within which two zooms are one, from now on.
  virtual void set_zoom_tolerance(double) {}

  // Empty: there is none.
  [[nodiscard]] virtual const ZoomCurve& zoom_curve() const = 0;

  // Keeps it in memory in any case, in place of the one for its zoom, within the tolerance; its `path` is
  // ignored. Its notes' zoom curve, if there is one, takes the place of the curve that there is. False with one line if it could not be written (disk full, no permission): what was stored before
  // stays stored, and save_pending() tries again. False too if the map is not valid: the calibration is then
  // stored without it, and nothing is pending.
  [[nodiscard]] virtual bool save(const StoredCalibration& calibration, std::string* error) = 0;
  [[nodiscard]] virtual bool has_pending() const = 0;
  [[nodiscard]] virtual bool save_pending(std::string* error) = 0;

  // Forgets the calibrations of all zooms and the curve, which are of another camera or lens. Their files are kept under other
  // names; returns what was done, for the log; empty: there were none.
  [[nodiscard]] virtual std::string set_zooms_aside() = 0;
};

}  // namespace alidade

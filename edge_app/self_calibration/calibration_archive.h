#pragma once
// CalibrationArchive: keeps the calibrations of one camera, one for each zoom setting, each with
// its map. CalibrationStore keeps them on disk. One thread, never the real-time thread.

#include <optional>
#include <string>

#include "core/calibration/calibration_text.h"
#include "core/model/calibration.h"
#include "core/realtime/oe_mode/map_state.h"

namespace alidade {

struct StoredCalibration {
  Calibration calibration;
  CalibrationNotes notes;  // all are written; only telemetry_error is read back
  MapState map;
  std::string path;  // of the file; empty: not stored yet
};

class CalibrationArchive {
 public:
  virtual ~CalibrationArchive() = default;

  // The calibration for a zoom reading (device units): the nearest one within the tolerance, else
  // one made from the zoom curve, else the one without a zoom, which holds for any reading. Without
  // a reading: the one without a zoom, else the one stored with the curve, else the only one. Null:
  // there is none. The pointer is valid until the next find() or save().
  [[nodiscard]] virtual const StoredCalibration* find(std::optional<double> zoom) const = 0;

  // From now on, two readings within this many device units are one zoom.
  virtual void set_zoom_tolerance(double) {}

  // Empty if there is none.
  [[nodiscard]] virtual const ZoomCurve& zoom_curve() const = 0;

  // Always keeps the calibration in memory, where it replaces the one for its zoom (within the
  // tolerance). Its `path` is ignored. A zoom curve in its notes replaces the present curve. False,
  // with one line in *error, if the file could not be written (disk full, no permission): the
  // earlier file stays, and save_pending() tries again. Also false if the map is not valid: the
  // calibration is then stored without the map, and nothing is pending.
  [[nodiscard]] virtual bool save(const StoredCalibration& calibration, std::string* error) = 0;
  // Whether a calibration could not be written yet.
  [[nodiscard]] virtual bool has_pending() const = 0;
  // Tries again. False, with one line in *error, if a file could not be written.
  [[nodiscard]] virtual bool save_pending(std::string* error) = 0;

  // Forgets the calibrations of all zooms and the curve: they belong to another camera or lens.
  // Their files are kept under other names. Returns what was done, for the log; empty if there was
  // nothing to forget.
  [[nodiscard]] virtual std::string set_zooms_aside() = 0;
};

}  // namespace alidade

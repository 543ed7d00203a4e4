#pragma once
// CalibrationStore: the calibrations of one camera on disk, one for each zoom setting, each with its map.
//   FILE                      the calibration without zoom (INTERFACES: calibration.file)
//   STEM.zoom-1234.5.yaml     the one at that zoom, beside it
//   map: the side file that the yaml names, beside it, tied to it by version and checksum (map_file.h)
// A file that is damaged, or not of this image size, is set aside (renamed to NAME.damaged, .damaged.1 ...), said,
// and never used. A map that is damaged costs the map only. Everything is written atomically, the map
// first; a power cut leaves the old pair or the new one.
// Not for the real-time thread. One thread.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_file.h"
#include "core/model/calibration.h"
#include "core/realtime/map_state.h"

namespace alidade {

struct StoredCalibration {
  Calibration calibration;
  CalibrationNotes notes;  // not read back
  MapState map;
  std::string path;  // of the yaml; empty: not stored yet
};

class CalibrationStore {
 public:
  // file: the configuration's calibration.file; its folder is created at the first save.
  // zoom_tolerance: device units within which two zooms are one.
  explicit CalibrationStore(std::string file, double zoom_tolerance = 0);

  // Reads all there are; width, height: px of the video, 0: any size. Returns lines for the log: what
  // was loaded, what was set aside and why.
  [[nodiscard]] std::vector<std::string> load(int width, int height);

  // The calibration for a zoom: the nearest within the tolerance, else the one without zoom, which holds for
  // any. Without a zoom: the one without, else the only one. Null if there is none.
  [[nodiscard]] const StoredCalibration* find(std::optional<double> zoom) const;

  // Keeps it in memory in any case, in place of the one for its zoom. False with one line if it could not be
  // written (disk full, no permission); save_pending() tries again.
  [[nodiscard]] bool save(const StoredCalibration& calibration, std::string* error);
  [[nodiscard]] bool has_pending() const;
  [[nodiscard]] bool save_pending(std::string* error);

 private:
  struct Entry {
    StoredCalibration stored;
    bool pending = false;
  };
  std::string file_;
  double zoom_tolerance_;
  std::vector<Entry> entries_;
};

}  // namespace alidade

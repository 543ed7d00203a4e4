#pragma once
// CalibrationStore: the calibrations of one camera on disk, one for each zoom setting, each with
// its map.
//   FILE                   the calibration without zoom (calibration.file of the configuration)
//   STEM.zoom-1234.5.yaml  the calibration at zoom 1234.5 (device units), beside FILE. The zoom
//                          inside the file counts, not the zoom in its name.
//   *.map-1a2b3c4d.bin     the map that a yaml names, beside the yaml, tied to it by checksum
//                          (map_file.h)
// A damaged file is set aside and logged, never used. One for pictures of another size is not used,
// but stays until another calibration is saved: the configured size may be a slip. Files are
// written atomically: a power cut leaves the old calibration and map, or the new ones. Where the
// zoom curve is, and the order of writing: docs/derivations.md. Not for the real-time thread. One
// thread.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/model/lens/zoom_curve.h"
#include "edge_app/self_calibration/calibration_archive.h"
#include "platform/system/file_lock.h"

namespace alidade {

// Whether a zoom reading (device units) lies between the first and last zoom of the curve, which
// must not be empty. Beyond these the curve continues, with less certainty.
[[nodiscard]] inline bool is_between_zooms(const ZoomCurve& curve, double reading) {
  return (reading - curve.first_reading()) * (reading - curve.last_reading()) <= 0;
}

// The name, for people, of what a file's curve, not empty, gives at a reading.
[[nodiscard]] inline std::string name_on_curve(const std::string& path, const ZoomCurve& curve,
                                               double reading) {
  return path + (is_between_zooms(curve, reading) ? ", between its zooms" : ", beyond its zooms");
}

// Paths of the calibrations of zooms beside a configured calibration.file, sorted; empty if there
// are none, or the folder cannot be read.
[[nodiscard]] std::vector<std::string> calibrations_of_zooms(const std::string& file);

class CalibrationStore final : public CalibrationArchive {
 public:
  // file: the configuration's calibration.file. lock() and the first save create its folder.
  // zoom_tolerance: device units; readings no further apart are one zoom.
  explicit CalibrationStore(std::string file, double zoom_tolerance = 0);

  // Reads all files. width, height: px of the video; 0: any size. Returns lines for the log: what
  // was loaded, what was set aside and why. kLook: changes no file; a damaged file stays in place.
  enum class Use { kKeep, kLook };
  [[nodiscard]] std::vector<std::string> load(int width, int height, Use use = Use::kKeep);

  // To be called before load(). Without the lock, one of several processes that keep calibrations
  // under this name would remove another's map. On failure *why is one line.
  [[nodiscard]] FileLock::Result lock(std::string* why);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] const StoredCalibration* find(std::optional<double> zoom) const override;
  void set_zoom_tolerance(double tolerance) override { zoom_tolerance_ = tolerance; }
  [[nodiscard]] const ZoomCurve& zoom_curve() const override { return curve_; }
  [[nodiscard]] bool save(const StoredCalibration& calibration, std::string* error) override;
  [[nodiscard]] bool has_pending() const override;
  [[nodiscard]] bool save_pending(std::string* error) override;
  // Renames the calibrations with a zoom to NAME.replaced, .replaced.1 ..., with their maps.
  [[nodiscard]] std::string set_zooms_aside() override;

 private:
  struct Entry {
    StoredCalibration stored;
    bool pending = false;
  };

  // Sets a calibration aside with its maps, unless kLook. Says what was done, or would be done.
  [[nodiscard]] std::string set_file_aside(const std::string& path) const;
  void load_file(const std::string& path, int width, int height, std::vector<std::string>* lines);
  [[nodiscard]] std::optional<std::size_t> nearest(std::optional<double> zoom) const;
  [[nodiscard]] std::string free_path(const StoredCalibration& stored) const;
  [[nodiscard]] bool write(Entry* entry, std::string* error);

  std::string file_;
  FileLock lock_;
  double zoom_tolerance_;
  Use use_ = Use::kKeep;
  std::vector<Entry> entries_;
  ZoomCurve curve_;
  std::string curve_path_;               // of the file that holds curve_
  std::vector<std::string> other_size_;  // files of calibrations for other pictures
  mutable StoredCalibration between_;    // what find() last made from the curve
};

}  // namespace alidade

#pragma once
// CalibrationStore: the calibrations of one camera on disk, one for each zoom setting, each with its map.
//   FILE                      the calibration without zoom (INTERFACES: calibration.file)
//   STEM.zoom-1234.5.yaml     the one at that zoom, beside it; the zoom that it holds counts, not its name
//   either                    may hold the camera's zoom curve, which gives a calibration where no file has one: the file of
//                             the calibration with which it came, FILE if there was none
//   *.map-1a2b3c4d.bin        the map that a yaml names, beside it, tied to it by checksum (map_file.h)
// A file that is damaged, cannot be read, or is not of this image size, is set aside with its maps (renamed to
// NAME.damaged, .damaged.1 ...), said, and never used. A map that is damaged costs the map only.
// Each file is written atomically: first the map, under a name that no other content has, then the yaml
// that names it, and only then the old map is removed. A power cut leaves the old pair or the new one, and
// perhaps a map that nobody names, which the next save removes. What a killed process left unfinished goes at load().
// Not for the real-time thread. One thread.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/model/zoom_curve.h"
#include "edge_app/self_calibration/calibration_archive.h"
#include "platform/system/file_lock.h"

namespace alidade {

// A curve goes on beyond its first and last zoom, with less certainty.
[[nodiscard]] inline bool is_between_zooms(const ZoomCurve& curve, double reading) {
  return (reading - curve.first_reading()) * (reading - curve.last_reading()) <= 0;
}

// What the curve of a file has at a reading, as people are told of it.
[[nodiscard]] inline std::string name_on_curve(const std::string& path, const ZoomCurve& curve,
                                               double reading) {
  return path + (is_between_zooms(curve, reading) ? ", between its zooms" : ", beyond its zooms");
}

class CalibrationStore final : public CalibrationArchive {
 public:
  // file: the configuration's calibration.file; its folder is created by lock() and by the first save.
  // zoom_tolerance: device units within which two zooms are one.
  explicit CalibrationStore(std::string file, double zoom_tolerance = 0);

  // Reads all there are; width, height: px of the video, 0: any size. Returns lines for the log: what
  // was loaded, what was set aside and why. kLook: no file is touched.
  enum class Use { kKeep, kLook };
  [[nodiscard]] std::vector<std::string> load(int width, int height, Use use = Use::kKeep);

  // To be taken before load(): of several processes that kept their calibrations here, one would remove another's map.
  [[nodiscard]] FileLock::Result lock(std::string* why);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] const StoredCalibration* find(std::optional<double> zoom) const override;
  void set_zoom_tolerance(double tolerance) override { zoom_tolerance_ = tolerance; }
  [[nodiscard]] const ZoomCurve& zoom_curve() const override { return curve_; }
  [[nodiscard]] bool save(const StoredCalibration& calibration, std::string* error) override;
  [[nodiscard]] bool has_pending() const override;
  [[nodiscard]] bool save_pending(std::string* error) override;
  // Renamed to NAME.replaced, .replaced.1 ..., with their maps.
  [[nodiscard]] std::string set_zooms_aside() override;

 private:
  struct Entry {
    StoredCalibration stored;
    bool pending = false;
  };

  // With the maps of a calibration; says what was done, or would be.
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
  std::string curve_path_;             // of the file that holds it
  mutable StoredCalibration between_;  // by the curve: what find() made last
};

}  // namespace alidade

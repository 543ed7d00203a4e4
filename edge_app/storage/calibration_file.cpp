#include "edge_app/storage/calibration_file.h"

#include "platform/system/whole_file.h"

namespace alidade {

bool load_calibration(const std::string& path, Calibration* calibration, std::string* error,
                      ZoomCurve* curve) {
  std::string text;
  return read_file(path, &text, error) && parse_calibration(text, path, calibration, error, curve);
}

bool save_calibration(const std::string& path, const Calibration& calibration, std::string* error) {
  return save_calibration(path, calibration, {}, error);
}

bool save_calibration(const std::string& path, const Calibration& calibration,
                      const CalibrationNotes& notes, std::string* error) {
  const std::string text = format_calibration(calibration, notes);
  Calibration as_read;
  if (!parse_calibration(text, "refused to write " + path, &as_read, error)) return false;
  return write_file_atomically(path, text, error);
}

}  // namespace alidade

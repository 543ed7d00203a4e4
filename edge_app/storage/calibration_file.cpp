#include "edge_app/storage/calibration_file.h"

#include <algorithm>

#include "platform/streams/picture_size.h"
#include "platform/system/whole_file.h"

namespace alidade {

bool parse_stored_calibration(const std::string& text, const std::string& path,
                              Calibration* calibration, std::string* error, ZoomCurve* curve,
                              TelemetryError* telemetry_error) {
  Calibration read;
  if (!parse_calibration(text, path, &read, error, curve, telemetry_error)) return false;
  const Camera<double>& camera = read.camera;
  if (std::max(camera.width, camera.height) > kMostPictureSide) {
    *error = path + ": for pictures of " + std::to_string(camera.width) + "x" +
             std::to_string(camera.height) + " px, larger than " +
             std::to_string(kMostPictureSide) + " px";
    return false;
  }
  *calibration = read;
  return true;
}

bool load_calibration(const std::string& path, Calibration* calibration, std::string* error,
                      ZoomCurve* curve, TelemetryError* telemetry_error) {
  std::string text;
  return read_file(path, &text, error) &&
         parse_stored_calibration(text, path, calibration, error, curve, telemetry_error);
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

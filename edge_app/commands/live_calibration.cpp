#include "edge_app/commands/live_calibration.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/lens_prior.h"
#include "edge_app/commands/scene_loading.h"

namespace alidade {
namespace {

void set_lens_prior(const Config& config, SelfCalibrationOptions* options) {
  const std::string& path = config.calibration.prior;
  const Camera<double>& camera = options->data_sheet.camera;
  std::vector<std::string> remarks;
  options->camera = load_lens_prior(path, camera.width, camera.height, &remarks);
  for (const std::string& remark : remarks) spdlog::warn("{}", remark);
  if (config.camera.line_delay_s == 0) {
    options->data_sheet.line_delay = options->camera.line_delay.prior.value;
  } else {
    spdlog::info(
        "camera.line_delay_s is used instead of the line delay of {} until the camera is "
        "calibrated",
        path);
  }
}

// Locks the store if calibrations are made. Returns how the store may be used. Throws CommandError
// if another process holds the lock.
CalibrationStore::Use lock_store(const Config& config, CalibrationStore* store) {
  std::string why;
  if (!config.calibration.automatic) {
    // A process that does not calibrate only tests the lock, so it keeps nobody out. If a
    // calibrating process holds the lock, this one changes no file.
    FileLock in_use;
    return in_use.take(config.calibration.file, &why) == FileLock::Result::kInUse
               ? CalibrationStore::Use::kLook
               : CalibrationStore::Use::kKeep;
  }
  switch (store->lock(&why)) {
    case FileLock::Result::kTaken:
      break;
    case FileLock::Result::kInUse:
      throw CommandError(kExitFailed,
                         fmt::format("calibration.file {}; give each camera a file of its own, or, "
                                     "to use what that process stores, set calibration.auto: false",
                                     why));
    case FileLock::Result::kImpossible:
      spdlog::warn("{}; only one process may store calibrations there", why);
      break;
  }
  return CalibrationStore::Use::kKeep;
}

Calibrating begin_calibrating(const Config& config, const std::string& path,
                              CalibrationStore::Use use) {
  Calibrating result;
  SelfCalibrationOptions options;
  const int width = config.video.width;
  const int height = config.video.height;
  if (!config.calibration.file.empty()) {
    result.store = std::make_unique<CalibrationStore>(
        config.calibration.file, config.calibration.zoom_tolerance.value_or(0));
    const CalibrationStore::Use may =
        use == CalibrationStore::Use::kKeep ? lock_store(config, result.store.get()) : use;
    for (const std::string& line : result.store->load(width, height, may))
      spdlog::info("calibration: {}", line);
  }
  const StoredCalibration* stored =
      result.store == nullptr ? nullptr : result.store->find(std::nullopt);
  if (result.store != nullptr && result.store->empty() && !config.calibration.automatic) {
    throw CommandError(
        kExitUsage,
        fmt::format("{}: calibration.file {} holds no calibration that can be used, and "
                    "calibration.auto is false; name one, or set calibration.auto: true",
                    path, config.calibration.file));
  }
  if (config.camera.focal_length_px) {
    options.data_sheet = data_sheet_calibration(config.camera);
  } else if (stored != nullptr) {
    CameraConfig camera;
    camera.focal_length_px = stored->calibration.camera.focal_length;
    options.data_sheet = data_sheet_calibration(camera);
  } else {
    throw CommandError(
        kExitUsage, fmt::format("{}: camera.focal_length_px is missing: {} holds no calibration, "
                                "and the first one starts from the data sheet's focal length; give "
                                "it, or name a calibration in calibration.file",
                                path, config.calibration.file));
  }
  Camera<double>& camera = options.data_sheet.camera;
  camera.width = stored == nullptr ? width : stored->calibration.camera.width;
  camera.height = stored == nullptr ? height : stored->calibration.camera.height;
  // kLook (`check`) needs no size: it measures the size that the camera sends.
  if (camera.width == 0 && use == CalibrationStore::Use::kKeep) {
    throw CommandError(
        kExitUsage, path +
                        ": video.width and video.height are missing: without a calibration, OE "
                        "mode needs the size of the picture; give them, or set realtime.mode: PT");
  }
  if (config.calibration.automatic && !config.calibration.prior.empty() && camera.width > 0)
    set_lens_prior(config, &options);
  if (config.pan_tilt.angle_sigma_rad) {
    options.noise.pan_tilt_sigma_rad = std::hypot(
        *config.pan_tilt.angle_sigma_rad, config.pan_tilt.angle_quantum_rad / std::sqrt(12.0));
  }
  options.adjustment.centre_sigma_px =
      config.camera.centre_sigma_px.value_or(kUsualCentreShare * camera.width);
  options.adjustment.angle_accuracy_rad = config.pan_tilt.angle_accuracy_deg * kPi / 180;
  options.adjustment.pupil = config.camera.pupil;
  options.adjustment.scene = config.scene;
  options.zoom_tolerance = config.calibration.zoom_tolerance;
  options.zooms = config.camera.focal_length_range.has_value();
  options.automatic = config.calibration.automatic;
  result.calibration = std::make_unique<SelfCalibration>(options, result.store.get());
  return result;
}

}  // namespace

StartingCalibration load_starting_calibration(const Config& config, const std::string& path,
                                              CalibrationStore::Use use) {
  StartingCalibration start;
  if (!config.realtime.landmarks || is_recording(config) || !has_telemetry(config)) {
    start.calibration = choose_calibration(config);
    return start;
  }
  start.calibrating = begin_calibrating(config, path, use);
  start.calibration = *start.calibrating.calibration->first();
  return start;
}

std::optional<PublishedCalibration> calibration_at(const StartingCalibration& start, double zoom,
                                                   double tolerance) {
  const PublishedCalibration& first = start.calibration;
  const std::optional<double>& its = first.calibration.zoom;
  if (!its || std::abs(zoom - *its) <= tolerance) return first;
  PublishedCalibration there = first;
  there.map = {};
  CalibrationStore* store = start.calibrating.store.get();
  if (store != nullptr) {
    store->set_zoom_tolerance(tolerance);
    const StoredCalibration* stored = store->find(zoom);
    if (stored == nullptr) return std::nullopt;
    there.calibration = stored->calibration;
    there.telemetry_error = stored->notes.telemetry_error;
    there.name = stored->path;
    return there;
  }
  if (!first.zoom_curve.at(zoom, &there.calibration)) return std::nullopt;
  there.name = name_on_curve(first.name, first.zoom_curve, zoom);
  return there;
}

}  // namespace alidade

#pragma once
// The calibration that `alidade run` begins with and goes on to make: what is stored, else the data
// sheet. The one owner of which that is.

#include <memory>
#include <optional>
#include <string>

#include "edge_app/commands/command.h"
#include "edge_app/config/config.h"
#include "edge_app/self_calibration/self_calibration.h"
#include "edge_app/storage/calibration_store.h"

namespace alidade {

// What calibrates a camera while it runs; empty where nothing is to be calibrated.
struct Calibrating {
  std::unique_ptr<CalibrationStore> store;
  std::unique_ptr<SelfCalibration> calibration;
};

// What `run` begins with, and `check` looks at.
struct StartingCalibration {
  Calibrating calibrating;
  NamedCalibration calibration;
  MapState map;
};

// path: of the configuration, for errors. use: kLook touches no file. Throws CommandError where
// there is nothing to begin with.
[[nodiscard]] StartingCalibration load_starting_calibration(const Config& config,
                                                            const std::string& path,
                                                            CalibrationStore::Use use);

// What `run` has at a zoom reading as soon as the camera is there; none: nothing yet. tolerance:
// within which two readings are one.
[[nodiscard]] std::optional<NamedCalibration> calibration_at(const StartingCalibration& start,
                                                             double zoom, double tolerance);

}  // namespace alidade

#pragma once
// The calibration with which `alidade run` begins, and the objects that go on to calibrate. `run`
// begins with a stored calibration, or without one with the data sheet's. Only this file makes this
// choice.

#include <memory>
#include <optional>
#include <string>

#include "edge_app/commands/command.h"
#include "edge_app/config/config.h"
#include "edge_app/self_calibration/self_calibration.h"
#include "edge_app/storage/calibration_store.h"

namespace alidade {

// Calibrates the camera while it runs; both are null if nothing is to be calibrated. `calibration`
// borrows `store`.
struct Calibrating {
  std::unique_ptr<CalibrationStore> store;
  std::unique_ptr<SelfCalibration> calibration;
};

// What `run` begins with and `check` examines.
struct StartingCalibration {
  Calibrating calibrating;
  PublishedCalibration calibration;  // with the stored map
};

// path: of the configuration, for errors. use: kLook changes no file and takes no lock. Throws
// CommandError if there is nothing to begin with, a file cannot be used, or, with kKeep and
// calibration.auto, another process calibrates into the same file.
[[nodiscard]] StartingCalibration load_starting_calibration(const Config& config,
                                                            const std::string& path,
                                                            CalibrationStore::Use use);

// The calibration that `run` has at once for a zoom reading; empty: none yet. tolerance: device
// units; readings that differ by no more are one zoom.
[[nodiscard]] std::optional<PublishedCalibration> calibration_at(const StartingCalibration& start,
                                                                 double zoom, double tolerance);

}  // namespace alidade

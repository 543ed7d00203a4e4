#pragma once
// The calibration that `alidade run` begins with and goes on to make: what is stored, else the data sheet.

#include <memory>
#include <string>

#include "edge_app/config/config.h"
#include "edge_app/pipeline/self_calibration.h"
#include "edge_app/storage/calibration_store.h"

namespace alidade {

// What calibrates a camera while it runs; empty where nothing is to be calibrated.
struct Calibrating {
  std::unique_ptr<CalibrationStore> store;
  std::unique_ptr<SelfCalibration> calibration;
};

// path: of the configuration, for errors. Throws CommandError where there is nothing to begin with.
[[nodiscard]] Calibrating begin_calibrating(const Config& config, const std::string& path);

}  // namespace alidade

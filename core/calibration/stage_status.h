#pragma once
// Whether a stage of calibrate() went well, and if not, what the result says of it.

#include <string>

#include "core/calibration/calibration_types.h"

namespace alidade::internal {

struct StageStatus {
  CalibrationStatus status = CalibrationStatus::kOk;
  std::string message;  // of a refusal

  [[nodiscard]] bool ok() const { return status == CalibrationStatus::kOk; }
};

}  // namespace alidade::internal

#pragma once
// The result of one stage of calibrate(): ok, or a refusal with its message.

#include <string>

#include "core/calibration/calibration_types.h"

namespace alidade::internal {

struct StageStatus {
  CalibrationStatus status = CalibrationStatus::kOk;
  std::string message;  // of a refusal

  [[nodiscard]] bool ok() const { return status == CalibrationStatus::kOk; }
};

}  // namespace alidade::internal

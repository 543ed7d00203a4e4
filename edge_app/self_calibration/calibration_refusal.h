#pragma once
// Why a session gave no calibration, and what would help. If most pictures were never looked at, as
// on an overloaded machine, the reason says so. A mismatch between telemetry and motion is then not
// reported, as too few pictures were seen to judge it. Pure; allocates.

#include <cstddef>
#include <string>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/checked_calibration.h"

namespace alidade {

struct CalibrationRefusal {
  CalibrationNeed need = CalibrationNeed::kTime;
  std::string why;  // begins with " (" or ": ", to follow "not calibrated yet"
};

// checked: must have a refusal. frames: the number of frames in its session.
[[nodiscard]] CalibrationRefusal why_refused(const CheckedCalibration& checked, std::size_t frames);

}  // namespace alidade

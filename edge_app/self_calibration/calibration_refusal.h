#pragma once
// Why a session gave no calibration, and what would help. Where most of the pictures never came to be looked at, as on a
// machine with too much to do, that is said too; and that telemetry did not describe the motion in the few that came is
// then not said, for nobody knows it. Pure; allocates.

#include <cstddef>
#include <string>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/session_calibration.h"

namespace alidade {

struct CalibrationRefusal {
  CalibrationNeed need = CalibrationNeed::kTime;
  std::string why;  // begins with " (" or ": ", to stand behind "not calibrated yet"
};

// Of a session of so many frames. Needs a refusal.
[[nodiscard]] CalibrationRefusal why_refused(const SessionCalibration& checked, std::size_t frames);

}  // namespace alidade

#pragma once
// Why a session gave no calibration, and what would help. If pictures were sent again while the
// camera turned, nobody knows when the others were taken; if most pictures were never looked at, as
// on an overloaded machine, too few were seen. The reason says so, and a mismatch between telemetry
// and motion, which follows from it, is not reported. Pure; allocates.

#include <cstddef>
#include <string>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/checked_calibration.h"

namespace alidade {

struct CalibrationRefusal {
  CalibrationNeed need = CalibrationNeed::kTime;
  std::string why;  // begins with " (" or ": ", to follow "not calibrated yet"
};

// checked: must have a refusal. frames: the number of frames in its session. repeated_share: of the
// pictures that came, those that were the one before.
[[nodiscard]] CalibrationRefusal why_refused(const CheckedCalibration& checked, std::size_t frames,
                                             double repeated_share);

}  // namespace alidade

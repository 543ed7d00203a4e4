#pragma once
// Why a session gave no calibration, and what would help. If pictures were sent again while the
// camera turned, it is not known when the other pictures were taken. If most pictures were never
// looked at, as on an overloaded machine, too few were seen. In both cases the reason says so, and
// the mismatch between telemetry and motion, which is only a consequence, is not reported. Pure;
// allocates.

#include <cstddef>
#include <string>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/checked_calibration.h"

namespace alidade {

struct CalibrationRefusal {
  CalibrationNeed need = CalibrationNeed::kTime;
  std::string why;  // begins with " (" or ": ", to follow "not calibrated yet"
};

// checked: must have a refusal. frames: the number of frames in its session. repeated_share: share
// of the pictures that repeated the picture before, 0 to 1.
[[nodiscard]] CalibrationRefusal why_refused(const CheckedCalibration& checked, std::size_t frames,
                                             double repeated_share);

}  // namespace alidade

#pragma once
// Why a session gave no calibration, and what would help. If more than 1 % of the pictures were
// sent again while the camera turned, nobody knows when the others were taken: that is the reason,
// in place of a mismatch with telemetry, no convergence or a failed check. Else, if fewer than half
// of the pictures were looked at, as on an overloaded machine, that takes the place of a mismatch
// and is added to no convergence, a failed check or a weak result. Other refusals, such as too
// little motion, stay as they are. Pure; allocates.

#include <cstddef>
#include <string>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/checked_calibration.h"

namespace alidade {

struct CalibrationRefusal {
  CalibrationNeed need = CalibrationNeed::kTime;
  // Begins with " (" or ": ", to follow "not calibrated yet" or "no fresh calibration yet".
  std::string why;
};

// checked: must have a refusal. frames: the number of frames in its session. repeated_share: share
// of the pictures that repeated the picture before, 0 to 1.
[[nodiscard]] CalibrationRefusal why_refused(const CheckedCalibration& checked, std::size_t frames,
                                             double repeated_share);

}  // namespace alidade

#pragma once
// calibration.yaml on disk; what it says: core/calibration/calibration_text.h. Not for the real-time thread. No shared
// state.

#include <string>

#include "core/calibration/calibration_text.h"

namespace alidade {

// False leaves one line in *error: `path: cannot be read: why`, or what is wrong in which line.
// curve, if not null: its zoom curve, empty without one.
[[nodiscard]] bool load_calibration(const std::string& path, Calibration* calibration,
                                    std::string* error, ZoomCurve* curve = nullptr);

// The text of such a file; refused also where no picture of ours is as large. path stands for it in errors.
[[nodiscard]] bool parse_stored_calibration(const std::string& text, const std::string& path,
                                            Calibration* calibration, std::string* error,
                                            ZoomCurve* curve = nullptr);

// Atomic: a reader, or a power cut, meets the old file or the new one, never half of one. A
// calibration that load_calibration() would refuse is refused here.
[[nodiscard]] bool save_calibration(const std::string& path, const Calibration& calibration,
                                    const CalibrationNotes& notes, std::string* error);
[[nodiscard]] bool save_calibration(const std::string& path, const Calibration& calibration,
                                    std::string* error);

}  // namespace alidade

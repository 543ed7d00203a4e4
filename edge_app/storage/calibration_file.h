#pragma once
// calibration.yaml on disk; its content: core/calibration/calibration_text.h. Not for the real-time
// thread. No shared state.

#include <string>

#include "core/calibration/calibration_text.h"

namespace alidade {

// False: one line in *error: `path: cannot be read: why`, or what is wrong in which line. curve,
// telemetry_error: may be null; else set to the file's, or to an empty one if the file has none.
[[nodiscard]] bool load_calibration(const std::string& path, Calibration* calibration,
                                    std::string* error, ZoomCurve* curve = nullptr,
                                    TelemetryError* telemetry_error = nullptr);

// Parses the text of such a file. Also refuses images larger than any picture accepted here. path:
// named in errors.
[[nodiscard]] bool parse_stored_calibration(const std::string& text, const std::string& path,
                                            Calibration* calibration, std::string* error,
                                            ZoomCurve* curve = nullptr,
                                            TelemetryError* telemetry_error = nullptr);

// Atomic: a reader, or a power cut, finds the old file or the new one, never half of one. Refuses a
// calibration that load_calibration() would refuse.
[[nodiscard]] bool save_calibration(const std::string& path, const Calibration& calibration,
                                    const CalibrationNotes& notes, std::string* error);
[[nodiscard]] bool save_calibration(const std::string& path, const Calibration& calibration,
                                    std::string* error);

}  // namespace alidade

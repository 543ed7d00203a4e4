#pragma once
// A calibration as JSON, with the names and units of calibration.yaml and all digits of a double.

#include <nlohmann/json_fwd.hpp>

#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"
#include "core/model/telemetry_error.h"

namespace alidade {

// Each parameter as name: {value, sigma}.
nlohmann::ordered_json parameters_json(const Calibration& calibration);

// All of calibration.yaml except the notes on the run that wrote it.
nlohmann::ordered_json calibration_json(const Calibration& calibration);

// The telemetry's errors that were found, with the keys of calibration.yaml; a curve has samples in
// addition to its knots.
nlohmann::ordered_json telemetry_error_json(const TelemetryError& error);

// curve: not empty. Its nodes at dwells, and samples of the focal length (px) from the first to the
// last zoom reading.
nlohmann::ordered_json zoom_curve_json(const ZoomCurve& curve);

}  // namespace alidade

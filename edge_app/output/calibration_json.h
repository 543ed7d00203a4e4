#pragma once
// A calibration as JSON, with the names, units and bits of calibration.yaml.

#include <nlohmann/json_fwd.hpp>

#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"
#include "core/model/telemetry_error.h"

namespace alidade {

// Each parameter as name: {value, sigma}.
nlohmann::ordered_json parameters_json(const Calibration& calibration);

// All of calibration.yaml except the notes on the run that wrote it.
nlohmann::ordered_json calibration_json(const Calibration& calibration);

// The keys of what telemetry is off by, as far as it is; a curve has samples over its knots, too.
nlohmann::ordered_json telemetry_error_json(const TelemetryError& error);

// A zoom curve, not empty: its nodes at dwells, and samples of the focal length from the first to
// the last reading.
nlohmann::ordered_json zoom_curve_json(const ZoomCurve& curve);

}  // namespace alidade

#pragma once
// A calibration as JSON, with the names, units and bits of calibration.yaml.

#include <nlohmann/json_fwd.hpp>

#include "core/model/calibration.h"

namespace alidade {

// Each parameter as name: {value, sigma}.
nlohmann::ordered_json parameters_json(const Calibration& calibration);

// All of the file but for what it tells of the run that wrote it.
nlohmann::ordered_json calibration_json(const Calibration& calibration);

}  // namespace alidade

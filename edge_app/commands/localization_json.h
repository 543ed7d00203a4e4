#pragma once
// Where a picture looks by a scene map, as commands print it: keys into a JSON object, angles in the map's base. Pure; allocates.

#include <nlohmann/json_fwd.hpp>

#include "core/mapping/localization.h"
#include "core/model/mechanics.h"

namespace alidade {

// "status" and "matches"; with kOk, angles, orientation and lens, and their standard deviations, too.
void add_localization(const Localization& found, const Mechanics<double>& mechanics,
                      nlohmann::ordered_json* json);

}  // namespace alidade

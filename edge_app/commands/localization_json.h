#pragma once
// Where a picture looks by a scene map, as commands print it: keys into a JSON object, angles in the map's base. Pure; allocates.

#include <nlohmann/json_fwd.hpp>

#include "core/mapping/localization.h"
#include "core/model/mechanics.h"

namespace alidade {

// "status" and "matches"; with kOk, angles, orientation and lens when "reference_row" was exposed,
// their standard deviations, and how much the camera turned (in its own frame) and log f changed
// from the first row to the last, too.
void add_localization(const Localization& found, const Mechanics<double>& mechanics,
                      nlohmann::ordered_json* json);

}  // namespace alidade

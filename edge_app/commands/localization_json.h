#pragma once
// A localization by a scene map as JSON, as commands print it. Angles are in the map's base. Pure;
// allocates.

#include <nlohmann/json_fwd.hpp>

#include "core/mapping/localization.h"
#include "core/model/mechanics.h"

namespace alidade {

// Adds "status" and "matches" to the object *json. With kOk, also adds angles, orientation and lens
// at the time when "reference_row" was exposed, their standard deviations, and the change from the
// first row to the last: the turn of the camera in its own frame (rad), and the change of log f.
void add_localization(const Localization& found, const Mechanics<double>& mechanics,
                      nlohmann::ordered_json* json);

}  // namespace alidade

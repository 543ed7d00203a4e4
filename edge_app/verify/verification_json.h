#pragma once
// A verification as one line of JSON. Fields: README.md. Pure; allocates.

#include <string>
#include <utility>
#include <vector>

#include "edge_app/verify/verification.h"

namespace alidade {

// files: kind and path of each.
[[nodiscard]] std::string verification_json(
    const Verification& verification,
    const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace alidade

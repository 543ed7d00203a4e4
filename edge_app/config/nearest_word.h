#pragma once
// The word that somebody meant who mistyped it: for "did you mean" in the configuration and on the command line.
// Pure; allocates.

#include <optional>
#include <string>
#include <vector>

namespace alidade {

// The one of `known` that is fewest slips away from `typed`: a letter left out, added, replaced, or exchanged with its
// neighbour. The first of those as near; none where it takes more than one slip in three letters.
[[nodiscard]] std::optional<std::string> nearest_word(const std::string& typed,
                                                      const std::vector<std::string>& known);

// "; did you mean WORD?", or nothing.
[[nodiscard]] std::string did_you_mean(const std::string& typed,
                                       const std::vector<std::string>& known);

}  // namespace alidade

#pragma once
// Finds the word that a mistyped one was probably meant to be, for "did you mean" in the
// configuration and on the command line. Pure; allocates.

#include <optional>
#include <string>
#include <vector>

namespace alidade {

// The word of `known` with the fewest slips from `typed`. A slip is a letter left out, added,
// replaced, or exchanged with its neighbour. Of equally near words the first is taken. Empty if
// no word is within one slip for each three letters of the longer of the two.
[[nodiscard]] std::optional<std::string> nearest_word(const std::string& typed,
                                                      const std::vector<std::string>& known);

// "; did you mean WORD?", or nothing.
[[nodiscard]] std::string did_you_mean(const std::string& typed,
                                       const std::vector<std::string>& known);

}  // namespace alidade

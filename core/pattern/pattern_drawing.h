#pragma once
// A known pattern as an SVG page in true size, for printing at 100 %. A caption below or at its
// side says what it is, and a ruler shows whether the printer kept the size. They are left out
// where the paper has no room for them; so are an AprilGrid's outer black squares. Pure text.
// pattern: as parse_pattern() accepts it.

#include <optional>
#include <string>

#include "core/pattern/known_pattern.h"

namespace alidade {

// paper: a4, a3, a2, a1, a0 or letter; landscape if the pattern is wider than high. Empty and one
// line in *error if the paper is unknown or too small.
[[nodiscard]] std::optional<std::string> draw_pattern(const KnownPattern& pattern,
                                                      const std::string& paper, std::string* error);

}  // namespace alidade

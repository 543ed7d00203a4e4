#pragma once
// Makes text from any origin safe for a terminal, a log or a journal. Characters that a terminal
// would obey, and those that break a line, are shown as escapes. UTF-8 stays as it is.

#include <string>
#include <string_view>

namespace alidade {

// Escapes: \n, \r, \t; \x1b for other control bytes and for invalid UTF-8; \u009b for control
// characters beyond ASCII, including those of text direction.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace alidade

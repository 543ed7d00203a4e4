#pragma once
// Text as it may go to a terminal, a log or a journal, whoever wrote it: what is not to be seen there but obeyed, or would make two
// lines of one, is shown as an escape. UTF-8 stays as it is.

#include <string>
#include <string_view>

namespace alidade {

// \n, \r, \t; \x1b for other control bytes and for what is no UTF-8; \u009b for controls beyond ASCII, of direction too.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace alidade

#pragma once
// The log on stderr, and the error line with which a command ends. Messages may hold text from
// cameras, peers and files. They are escaped (platform/system/escaped.h), so that each stays on one
// line.

#include <string>

namespace alidade {

// Must be called before anything is logged.
void start_log();

// Prints `alidade: TEXT` on stderr.
void print_error(const std::string& text);

}  // namespace alidade

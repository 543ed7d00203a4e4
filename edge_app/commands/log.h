#pragma once
// The log on stderr, and the one line with which a command ends. What goes there may hold text of cameras, peers and files: it is shown
// escaped (platform/system/escaped.h), each message on one line.

#include <string>

namespace alidade {

// Before anything is logged.
void start_log();

// `alidade: TEXT`
void print_error(const std::string& text);

}  // namespace alidade

#pragma once
// The command line: sub-commands, their options, help. Only command_line.cpp includes the parser,
// which takes longer to compile than most sub-commands.

namespace alidade {

// Runs the sub-command that the arguments of main() name. Returns the exit code. If the arguments
// are wrong or the sub-command fails, prints one line on stderr that says why.
[[nodiscard]] int run_command_line(int argc, char** argv);

}  // namespace alidade

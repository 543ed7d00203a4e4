#pragma once
// The command line: sub-commands, their options, help. The only place that includes its parser, which takes longer to
// compile than most sub-commands do.

namespace alidade {

// Runs the sub-command that the arguments of main() name. Returns the exit code; says on stderr, in one line, what is
// wrong with the arguments or why the sub-command failed.
[[nodiscard]] int run_command_line(int argc, char** argv);

}  // namespace alidade

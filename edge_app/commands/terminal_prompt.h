#pragma once
// Questions to the user at the terminal.

#include <optional>
#include <string>

namespace alidade {

// Whether there is somebody to ask: stdin and stderr are a terminal.
[[nodiscard]] bool can_ask();

// The answer, without the blanks around it. nullopt: there is none (end of input).
[[nodiscard]] std::optional<std::string> ask(const std::string& question);
// The same without echo and with all blanks. The echo is off before the question is shown.
// Meanwhile the keys that send signals are read as text.
[[nodiscard]] std::optional<std::string> ask_secret(const std::string& question);

}  // namespace alidade

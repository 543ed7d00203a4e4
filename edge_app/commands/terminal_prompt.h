#pragma once
// Questions to the user at the terminal.

#include <optional>
#include <string>

namespace alidade {

// Whether there is somebody to ask: stdin and stderr are a terminal.
[[nodiscard]] bool can_ask();

// The answer, without the blanks around it. nullopt: there is none (end of input).
[[nodiscard]] std::optional<std::string> ask(const std::string& question);
// The same without echo, by OpenSSL, which restores the terminal after any signal.
[[nodiscard]] std::optional<std::string> ask_secret(const std::string& question);

}  // namespace alidade

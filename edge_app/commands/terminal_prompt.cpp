#include "edge_app/commands/terminal_prompt.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <iostream>

#include "edge_app/commands/command.h"
#include "platform/system/text.h"

namespace alidade {

bool can_ask() { return is_terminal(STDIN_FILENO) && is_terminal(STDERR_FILENO); }

std::optional<std::string> ask(const std::string& question) {
  std::fputs(question.c_str(), stderr);
  std::fflush(stderr);
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return std::string(trimmed(line, " \t\r"));
}

std::optional<std::string> ask_secret(const std::string& question) {
  std::array<char, 256> text{};
  const int failed = EVP_read_pw_string_min(text.data(), 0, static_cast<int>(text.size()) - 1,
                                            question.c_str(), 0);
  const std::string secret = text.data();
  OPENSSL_cleanse(text.data(), text.size());
  return failed == 0 ? std::optional(secret) : std::nullopt;
}

}  // namespace alidade

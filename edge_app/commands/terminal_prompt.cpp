#include "edge_app/commands/terminal_prompt.h"

#include <openssl/crypto.h>
#include <unistd.h>

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

// OpenSSL's EVP_read_pw_string() asks before it switches the echo off: what is typed at once is shown.
std::optional<std::string> ask_secret(const std::string& question) {
  char* const typed = ::getpass(question.c_str());
  if (typed == nullptr) return std::nullopt;
  std::string secret = typed;
  OPENSSL_cleanse(typed, secret.size());
  return secret;
}

}  // namespace alidade

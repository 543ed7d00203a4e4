#pragma once
// ask_http(): one HTTP request and its whole answer, on the calling thread, within a time limit.
// Follows no redirection. A login goes to the asked host alone: by digest, or basic where
// `rules` permit it (link_rules.h).

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "platform/system/link_rules.h"

namespace alidade {

struct HttpQuestion {
  std::string url;                   // without user and password
  std::optional<std::string> body;   // sent by POST; nullopt: GET
  std::vector<std::string> headers;  // "Name: value"
  std::string user;                  // empty: no login
  std::string password;
  LinkRules rules;
  double timeout_s = 5;
  std::size_t most_bytes = std::size_t{512} << 10;  // of the answer; a longer one is an error
};

struct HttpReply {
  long status = 0;  // 0: no answer
  std::string body;
  bool offers_digest = false;  // with 401
  std::string error;  // status 0: one line without the URL; 401: what may be wrong with the login
};

[[nodiscard]] HttpReply ask_http(const HttpQuestion& question);

}  // namespace alidade

#pragma once
// Where an HttpServer listens, who may ask, and what one client may cost.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "platform/system/file_stamp.h"

namespace alidade {

struct HttpLimits {
  // At once. The next takes the place of the oldest of the address that has most.
  int max_strangers = 128;  // that have not shown the token, or where none is set
  int max_with_token = 64;
  int max_streams =
      32;  // endless answers; beyond: 503, but the address that has most gives one to one with less
  std::size_t max_head_bytes = 8192;
  double head_timeout_s = 5;   // from the connection to the head's last byte
  double body_timeout_s = 10;  // from there to the body's last byte
  double write_timeout_s = 10;
  double requests_per_s =
      500;  // of all strangers, and of all with the token; shared by their addresses
};

enum class HttpRight {
  kView,    // whatever changes nothing
  kControl  // everything
};

struct HttpToken {
  std::string text;
  HttpRight right = HttpRight::kControl;
};

// PEM files, read anew when they have changed.
struct HttpTlsOptions {
  std::string certificate;  // the server's first, then those between it and the authority
  std::string key;
};

struct HttpServerOptions {
  std::string host = "127.0.0.1";
  int port = 0;                   // 0: one that is free
  std::string token;              // may do everything; without it and tokens none is asked for
  std::vector<HttpToken> tokens;  // further ones
  // Where the tokens were read and are read anew when it has changed; empty: they stay. http_tokens.h.
  std::string token_file;
  bool token_file_holds_several = false;
  FileStamp token_file_stamp;
  std::optional<HttpTlsOptions> tls;
  HttpLimits limits;
};

}  // namespace alidade

#pragma once
// Where an HttpServer listens, who may ask, and the limits for a client.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "platform/system/file_stamp.h"

namespace alidade {

struct HttpLimits {
  // Connections at the same time. A further one takes the place of the oldest connection of the
  // address that holds most.
  int max_strangers = 128;  // connections that showed no token; all of them if no token is set
  int max_with_token = 64;
  // Endless answers at the same time. A further one gets 503. But if another address holds at least
  // two more than the client's, that other address loses its newest and the client is served.
  int max_streams = 32;
  std::size_t max_head_bytes = 8192;
  double head_timeout_s = 5;   // from the connection to the last byte of the head
  double body_timeout_s = 10;  // from the last byte of the head to that of the body
  // without a byte taken by the client; a finite answer must be taken within 60 s
  double write_timeout_s = 10;
  // Limit for all strangers together; the clients with a token have the same limit of their own.
  // The addresses of a group share its limit. With TLS, handshakes have such a limit, too, for each
  // of the two groups.
  double requests_per_s = 500;
};

enum class HttpRight {
  kView,    // everything that changes nothing
  kControl  // everything
};

struct HttpToken {
  std::string text;
  HttpRight right = HttpRight::kControl;
};

// Paths of PEM files. The files are read again when they change.
struct HttpTlsOptions {
  std::string certificate;  // the server's first, then the intermediate ones
  std::string key;
};

struct HttpServerOptions {
  std::string host = "127.0.0.1";
  int port = 0;                   // 0: any free port
  std::string token;              // may do everything
  std::vector<HttpToken> tokens;  // further tokens; if `token` is empty, too, none is needed
  // Path of the tokens' file, which is read again when it changes (http_tokens.h). Empty: the
  // tokens above stay.
  std::string token_file;
  bool token_file_holds_several = false;
  FileStamp token_file_stamp;
  std::optional<HttpTlsOptions> tls;
  HttpLimits limits;
};

// How a start waits for the name of its host: until the descriptor is readable, or timeout_s has
// passed. False: give up, the program ends.
using HttpStartWait = std::function<bool(int descriptor, double timeout_s)>;

}  // namespace alidade

#pragma once
// Where an HttpServer listens, who may ask, and what one client may cost.

#include <cstddef>
#include <string>

namespace alidade {

struct HttpLimits {
  int max_connections = 64;  // at once; beyond: 503
  int max_streams = 32;      // of these, how many may be endless answers; beyond: 503
  std::size_t max_head_bytes = 8192;
  double head_timeout_s = 5;   // from the connection to the head's last byte
  double body_timeout_s = 10;  // from there to the body's last byte
  double write_timeout_s = 10;
  double requests_per_s = 500;  // of all clients together; as many may come at once
};

struct HttpServerOptions {
  std::string host = "127.0.0.1";
  int port = 0;       // 0: one that is free
  std::string token;  // empty: none is asked for
  HttpLimits limits;
};

}  // namespace alidade

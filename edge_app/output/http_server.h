#pragma once
// HttpServer: cpp-httplib's server behind a door that hostile or broken clients cannot hold open.
//
//   one request a connection; one thread a connection, of a pool that grows up to max_connections; a connection
//   beyond that is answered 503 at once.
//   head    must be complete within head_timeout_s, in max_head_bytes, else 408, 431; a `Range` is ignored,
//           as HTTP allows (the library's pattern for it recurses once a character)
//   body    must state its length, up to the route's limit, and come within body_timeout_s, else 411, 413
//   answer  a client that takes nothing for write_timeout_s is dropped
//   rate    requests_per_s with as many at once, of all clients together, else 429
//   token   if one is set, routes that are not open want `Authorization: Bearer TOKEN`, else 401; compared in
//           a time that does not tell how much of it was right; never logged
//   pages of other sites   a POST whose Origin is not this server is refused (403); so is, without a token, a Host
//           that is a name other than localhost (DNS rebinding)
// Every error is JSON, {"error": "one line"}. Threads run at the normal scheduling policy, niced.
// Handlers run on those threads, several at a time.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace alidade {

struct HttpLimits {
  int max_connections = 64;
  int max_streams = 32;  // of these, how many may be endless answers; beyond: 503
  std::size_t max_head_bytes = 8192;
  double head_timeout_s = 5;
  double body_timeout_s = 10;
  double write_timeout_s = 10;
  double requests_per_s = 500;
};

struct HttpServerOptions {
  std::string host = "127.0.0.1";
  int port = 0;       // 0: one that is free
  std::string token;  // empty: none is asked for
  HttpLimits limits;
};

struct ServerRequest {
  std::string method;
  std::string path;
  std::string body;
  std::vector<std::pair<std::string, std::string>> parameters;  // of the query, decoded

  [[nodiscard]] std::optional<std::string> parameter(const std::string& name) const;
};

// Where an endless answer goes, piece by piece.
class HttpStream {
 public:
  virtual ~HttpStream() = default;
  // False: the client is gone or stalled for too long, or the server stops; nothing more can be said.
  [[nodiscard]] virtual bool write(const std::string& piece) = 0;
};

struct ServerResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  // If set, called in place of body; the answer ends when it returns. It must not wait
  // for long without writing, unless set_on_stop() wakes it.
  std::function<void(HttpStream&)> stream;
};

[[nodiscard]] ServerResponse http_error(int status, const std::string& line);

using HttpHandler = std::function<ServerResponse(const ServerRequest&)>;

enum class HttpAccess {
  kToken,  // wants the token, if there is one
  kOpen    // never
};

struct HttpCounters {
  std::int64_t requests = 0;
  std::int64_t refused = 0;  // connections and requests beyond a limit
  std::int64_t unauthorized = 0;
  std::int64_t stalled = 0;      // connections dropped because the client took nothing
  std::int64_t connections = 0;  // now
  std::int64_t streams = 0;      // now
};

class HttpServer {
 public:
  explicit HttpServer(const HttpServerOptions& options);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // Before start(). A route is an exact path; HEAD is answered as GET is.
  void get(const std::string& path, HttpAccess access, HttpHandler handler);
  void post(const std::string& path, HttpAccess access, std::size_t max_body, HttpHandler handler);

  // Binds and listens. False with one line in *error.
  [[nodiscard]] bool start(std::string* error);
  // After start(): "127.0.0.1:8080", with the port that was found.
  [[nodiscard]] std::string address() const;

  // Ends all connections and waits for their handlers. on_stop is called first, to wake handlers that wait.
  void stop();
  void set_on_stop(std::function<void()> on_stop);

  [[nodiscard]] HttpCounters counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade

#pragma once
// HttpServer: routes and handlers behind a door that hostile or broken clients cannot hold open.
//
//   one request a connection; one thread for all connections, two for the handlers. Who has the token has places, a
//   rate and handlers' time before all others; within both groups addresses share alike (http_fairness.h).
//   places  where max_strangers or max_with_token are taken, the oldest of the address that has most is answered 503
//   head    must be complete within head_timeout_s, in max_head_bytes, else 408, 431
//   body    of a POST must state its length, up to the route's limit, and come within body_timeout_s, else 411, 413, 400;
//           any other request's is not read
//   answer  a client that takes nothing for write_timeout_s is dropped
//   rate    an address's share of requests_per_s, with as many at once, else 429
//   token   if one is set, routes that are not open want `Authorization: Bearer TOKEN`, else 401, and those that change something
//           one that may control, else 403; never logged (http_tokens.h)
//   TLS     if a certificate is set (http_tls.h): the handshake is part of the head's time, and counted as a request is, before it
//   method  another than the path's is answered 405, with those that it has in Allow
//   pages of other sites   a request whose Origin is not this server is refused (403); so is one of which the
//           browser says that it is from another site, and without a token a Host that is a name other than
//           localhost (DNS rebinding)
//   streams   without a token a request for one that has a browser's headers must show a ticket, else 403: a page of another
//           site can have a browser send it, but cannot read a ticket (http_tickets.h)
// Every error is JSON, {"error": "one line"}. Threads run at the normal scheduling policy, niced.

#include <memory>
#include <string>

#include "edge_app/output/http/http_gate.h"
#include "edge_app/output/http/http_message.h"
#include "edge_app/output/http/http_options.h"
#include "platform/system/niced_threads.h"

namespace alidade {

class HttpListener;

class HttpServer {
 public:
  explicit HttpServer(const HttpServerOptions& options);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // Before start(). A route is an exact path; HEAD is answered as GET is.
  void get(const std::string& path, HttpAccess access, HttpHandler handler);
  void post(const std::string& path, HttpAccess access, std::size_t max_body, HttpHandler handler);

  // For routes of HttpAccess::kStream. Any thread.
  [[nodiscard]] HttpTickets& tickets() { return gate_.tickets(); }

  // Before start(): whether certificate and key can be used, or none are asked for. False with one line in *error.
  [[nodiscard]] bool check_tls(std::string* error) const;
  // Binds and listens; once. False with one line in *error.
  [[nodiscard]] bool start(std::string* error);
  // After start(): "127.0.0.1:8080", with the port that was found.
  [[nodiscard]] const std::string& address() const { return address_; }

  // Any thread, as long as the server exists: endless answers may have more to say. Takes no lock and waits for nobody.
  void wake();

  // Ends all connections, and waits for handlers that run.
  void stop();

  // Any thread.
  [[nodiscard]] HttpCounters counters() const { return tally_.now(); }

 private:
  const HttpServerOptions options_;
  HttpTally tally_;
  HttpGate gate_;
  std::string address_;
  std::unique_ptr<HttpListener> listener_;
  NicedThreads threads_;
};

}  // namespace alidade

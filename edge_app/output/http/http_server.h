#pragma once
// HttpServer: routes and handlers, protected against hostile and broken clients.
//
// One request a connection; one thread for all connections, two for the handlers. Clients with a
// token have places and a rate of their own, and handlers answer them first. Within both groups
// addresses share equally (http_fairness.h). Every error is JSON, {"error": "one line"}. Threads
// run at the normal scheduling policy, niced.
//   places   if max_strangers or max_with_token are taken, the oldest connection of the address
//            that holds most is answered 503
//   head     complete within head_timeout_s and max_head_bytes, else 408, 431
//   body     of a POST: states its length, at most the route's limit, and comes within
//            body_timeout_s, else 411, 413, 400. The body of another request is not read
//   answer   a client that takes nothing for write_timeout_s is dropped
//   rate     an address's share of requests_per_s, and as many at once, else 429
//   token    if one is set, routes that are not open need `Authorization: Bearer TOKEN`, else 401.
//            Routes that change something need a token that may control, else 403. Tokens are never
//            logged (http_tokens.h)
//   TLS      if a certificate is set (http_tls.h): the handshake is part of the head's time, and is
//            counted like a request before it begins
//   method   a method that the path does not have is answered 405, with Allow
//   sites    403 for a request whose Origin is not this server, or that the browser says is from
//            another site; without token and TLS also for a Host name other than localhost and the
//            configured host (DNS rebinding)
//   streams  without a token a browser's request for a stream needs a ticket, else 403: a page of
//            another site can make a browser send it, but cannot read a ticket (http_tickets.h)

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

  // Must be called before start(). A route is an exact path; HEAD is answered like GET.
  void get(const std::string& path, HttpAccess access, HttpHandler handler);
  void post(const std::string& path, HttpAccess access, std::size_t max_body, HttpHandler handler);

  // For routes of HttpAccess::kStream. Any thread.
  [[nodiscard]] HttpTickets& tickets() { return gate_.tickets(); }

  // Call before start(). True if certificate and key can be used, or none are configured. False
  // with one line in *error.
  [[nodiscard]] bool check_tls(std::string* error) const;
  // Binds and listens; call once. False with one line in *error.
  [[nodiscard]] bool start(std::string* error);
  // After start(): "127.0.0.1:8080", with the actual port.
  [[nodiscard]] const std::string& address() const { return address_; }

  // Any thread, as long as the server exists: endless answers may have more to send. Takes no lock
  // and does not wait.
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

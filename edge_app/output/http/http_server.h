#pragma once
// HttpServer: routes and handlers, protected against hostile and broken clients.
//
// One request a connection; one thread for all connections, two for the handlers. Clients with a
// token have places and a rate of their own, and handlers answer them first. Within both groups
// addresses share equally (http_fairness.h). Every error is JSON, {"error": "one line"}. Threads
// run at the normal scheduling policy, niced. Limits and status codes: README.md of this folder.

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

  // Must be called before start(). A route is an exact path, but for get_below(); HEAD is answered
  // like GET.
  void get(const std::string& path, HttpAccess access, HttpHandler handler);
  // All paths that begin with `folder`, as "/manual/", and have no route of their own.
  void get_below(const std::string& folder, HttpAccess access, HttpHandler handler);
  void post(const std::string& path, HttpAccess access, std::size_t max_body, HttpHandler handler);

  // For routes of HttpAccess::kStream. Any thread.
  [[nodiscard]] HttpTickets& tickets() { return gate_.tickets(); }

  // To be called before start(). True if certificate and key can be used, or none are configured.
  // False with one line in *error.
  [[nodiscard]] bool check_tls(std::string* error) const;
  // Binds and listens; to be called once. A host's name must be found within 5 s. False with one
  // line in *error, or with an empty *error if `wait` gave up. `wait` is not called for a host that
  // is an address.
  [[nodiscard]] bool start(const HttpStartWait& wait, std::string* error);
  // The same with a wait that never gives up.
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

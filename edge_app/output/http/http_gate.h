#pragma once
// HttpGate: who may ask what. All that can be decided from a request's head, before its body is read.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "edge_app/output/http/http_fairness.h"
#include "edge_app/output/http/http_head.h"
#include "edge_app/output/http/http_message.h"
#include "edge_app/output/http/http_options.h"
#include "edge_app/output/http/http_tickets.h"

namespace alidade {

enum class HttpAccess {
  kToken,   // wants the token, if there is one
  kStream,  // so; without one, what a browser sends must show a ticket
  kOpen     // never
};

struct HttpRoute {
  HttpAccess access = HttpAccess::kToken;
  std::size_t max_body = 0;  // of a POST
  HttpHandler handler;
};

struct HttpCounters {
  std::int64_t requests = 0;
  std::int64_t refused = 0;  // connections and requests beyond a limit
  std::int64_t unauthorized = 0;
  std::int64_t stalled = 0;      // connections dropped because the client took nothing
  std::int64_t connections = 0;  // now
  std::int64_t streams = 0;      // now
};

// The same as they are counted: on the network thread, and read by any.
struct HttpTally {
  std::atomic<std::int64_t> requests{0};
  std::atomic<std::int64_t> refused{0};
  std::atomic<std::int64_t> unauthorized{0};
  std::atomic<std::int64_t> stalled{0};
  std::atomic<std::int64_t> connections{0};
  std::atomic<std::int64_t> streams{0};

  [[nodiscard]] HttpCounters now() const;
};

// Who asks: by address, and whether the token was shown. Where none is set nobody shows it.
struct HttpClient {
  HttpAddress address;
  bool has_token = false;
};

class HttpGate {
 public:
  HttpGate(const HttpServerOptions& options, HttpTally* tally);

  // Before the first admit().
  void add(const std::string& method, const std::string& path, HttpRoute route);

  // Any thread.
  [[nodiscard]] HttpTickets& tickets() { return tickets_; }

  // One thread. The route that answers; null: *refusal is the answer. Says whether the client has the token.
  [[nodiscard]] const HttpRoute* admit(const HttpHead& head, double now_s, HttpClient* client,
                                       ServerResponse* refusal);

 private:
  [[nodiscard]] std::optional<ServerResponse> check(const HttpHead& head, double now_s,
                                                    const HttpClient& client,
                                                    const HttpRoute** route);
  [[nodiscard]] bool shows_token(const HttpHead& head) const;
  [[nodiscard]] bool shows_ticket(const HttpHead& head, double now_s);
  [[nodiscard]] bool origin_is_own(const HttpHead& head) const;
  [[nodiscard]] bool host_is_trusted(const HttpHead& head) const;

  const std::string token_;
  const std::string own_host_;
  FairRate rate_of_strangers_;
  FairRate rate_with_token_;
  HttpTickets tickets_;
  HttpTally& tally_;
  std::map<std::string, std::map<std::string, HttpRoute>> routes_;  // by path and method
};

}  // namespace alidade

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
#include "edge_app/output/http/http_tokens.h"

namespace alidade {

enum class HttpAccess {
  kToken,    // wants a token, if there are any
  kControl,  // one that may control
  kStream,   // as kToken; where there are none, what a browser sends must show a ticket
  kOpen      // never
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

// Who asks: by address, and whether a token was shown, and what that may do. Where none is set nobody shows one.
struct HttpClient {
  HttpAddress address;
  bool has_token = false;
  HttpRight right = HttpRight::kView;
};

class HttpGate {
 public:
  HttpGate(const HttpServerOptions& options, HttpTally* tally);

  // Before the first admit().
  void add(const std::string& method, const std::string& path, HttpRoute route);

  // Any thread.
  [[nodiscard]] HttpTickets& tickets() { return tickets_; }

  // One thread. Whether a client may begin with TLS: its address's share, apart for those that showed a token lately. Counted
  // where not.
  [[nodiscard]] bool may_shake_hands(const HttpAddress& address, double now_s);

  // One thread. The route that answers; null: *refusal is the answer. Says whether the client has the token. A request whose
  // body is still to come costs nothing yet: then charge() when it has.
  [[nodiscard]] const HttpRoute* admit(const HttpHead& head, double now_s, bool body_to_come,
                                       HttpClient* client, ServerResponse* refusal);
  // False: the client's share is used up, *refusal is the answer.
  [[nodiscard]] bool charge(const HttpClient& client, double now_s, ServerResponse* refusal);

 private:
  [[nodiscard]] std::optional<ServerResponse> check(const HttpHead& head, double now_s,
                                                    const HttpClient& client,
                                                    const HttpRoute** route);
  [[nodiscard]] bool shows_ticket(const HttpHead& head, double now_s);
  [[nodiscard]] bool origin_is_own(const HttpHead& head) const;
  [[nodiscard]] bool host_is_trusted(const HttpHead& head) const;

  HttpTokens tokens_;
  const bool has_tls_;
  const std::string own_host_;
  FairRate rate_of_strangers_;
  FairRate rate_with_token_;
  FairRate handshakes_of_strangers_;
  FairRate handshakes_of_known_;
  RecentAddresses showed_token_;
  HttpTickets tickets_;
  HttpTally& tally_;
  std::map<std::string, std::map<std::string, HttpRoute>> routes_;  // by path and method
};

}  // namespace alidade

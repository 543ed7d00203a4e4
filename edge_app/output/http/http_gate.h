#pragma once
// HttpGate: who may ask what. The gate decides everything that follows from a request's head,
// before the body is read.

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
  kToken,    // needs a token, if any token is set
  kControl,  // needs a token that may control, if any token is set
  kStream,   // as kToken; if no token is set, a browser's request needs a ticket
  kOpen      // needs no token
};

struct HttpRoute {
  HttpAccess access = HttpAccess::kToken;
  std::size_t max_body = 0;  // bytes, of a POST
  HttpHandler handler;
};

struct HttpCounters {
  std::int64_t requests = 0;
  std::int64_t refused = 0;  // connections and requests beyond a limit
  std::int64_t unauthorized = 0;
  std::int64_t stalled = 0;      // connections dropped as the client took nothing
  std::int64_t connections = 0;  // now
  std::int64_t streams = 0;      // now
};

// HttpCounters while they are counted. The network thread writes; any thread may read.
struct HttpTally {
  std::atomic<std::int64_t> requests{0};
  std::atomic<std::int64_t> refused{0};
  std::atomic<std::int64_t> unauthorized{0};
  std::atomic<std::int64_t> stalled{0};
  std::atomic<std::int64_t> connections{0};
  std::atomic<std::int64_t> streams{0};

  [[nodiscard]] HttpCounters now() const;
};

// Who asks: the address, whether it showed a token, and the right of that token. If no token is
// set, has_token is false.
struct HttpClient {
  HttpAddress address;
  bool has_token = false;
  HttpRight right = HttpRight::kView;
};

class HttpGate {
 public:
  HttpGate(const HttpServerOptions& options, HttpTally* tally);

  // Must be called before the first admit().
  void add(const std::string& method, const std::string& path, HttpRoute route);
  // A route of all paths that begin with `folder`, which ends with a slash, and have none of their
  // own.
  void add_below(const std::string& method, const std::string& folder, HttpRoute route);

  // Any thread.
  [[nodiscard]] HttpTickets& tickets() { return tickets_; }

  // Network thread. Whether a client may begin a TLS handshake: true if its address has some of its
  // share left. Addresses that showed a token within RecentAddresses::kRecentS have shares of their
  // own. Refusals are counted. now_s: s, monotonic, as in all functions here.
  [[nodiscard]] bool may_shake_hands(const HttpAddress& address, double now_s);

  // Network thread. Returns the route that answers; null: *refusal is the answer. Sets token and
  // right of *client. A request whose body is still to come is not counted yet; charge() is to be
  // called when the body has come.
  [[nodiscard]] const HttpRoute* admit(const HttpHead& head, double now_s, bool body_to_come,
                                       HttpClient* client, ServerResponse* refusal);
  // Counts a request. False: the client's share is used up, *refusal is the answer.
  [[nodiscard]] bool charge(const HttpClient& client, double now_s, ServerResponse* refusal);

 private:
  using Methods = std::map<std::string, HttpRoute>;

  // Null: there is no such path.
  [[nodiscard]] const Methods* find(const std::string& path) const;
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
  std::map<std::string, Methods> routes_;   // by path and method
  std::map<std::string, Methods> folders_;  // the same, of add_below()
};

}  // namespace alidade

#pragma once
// HttpGate: who may ask what. All that can be decided from a request's head, before its body is read.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "edge_app/output/http/http_head.h"
#include "edge_app/output/http/http_message.h"
#include "edge_app/output/http/http_options.h"

namespace alidade {

enum class HttpAccess {
  kToken,  // wants the token, if there is one
  kOpen    // never
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

// As many requests as have been earned since the last, at most a second's worth.
class RateLimit {
 public:
  explicit RateLimit(double per_s);
  [[nodiscard]] bool take(double now_s);

 private:
  const double per_s_;
  const double most_;
  double left_;
  double last_s_ = 0;
};

class HttpGate {
 public:
  HttpGate(const HttpServerOptions& options, HttpTally* tally);

  // Before the first admit().
  void add(const std::string& method, const std::string& path, HttpRoute route);

  // One thread. The route that answers; null: *refusal is the answer.
  [[nodiscard]] const HttpRoute* admit(const HttpHead& head, double now_s, ServerResponse* refusal);

 private:
  [[nodiscard]] std::optional<ServerResponse> check(const HttpHead& head, double now_s,
                                                    const HttpRoute** route);
  [[nodiscard]] bool has_token(const HttpHead& head) const;
  [[nodiscard]] bool origin_is_own(const HttpHead& head) const;
  [[nodiscard]] bool host_is_trusted(const HttpHead& head) const;

  const std::string token_;
  const std::string own_host_;
  RateLimit rate_;
  HttpTally& tally_;
  std::map<std::string, std::map<std::string, HttpRoute>> routes_;  // by path and method
};

}  // namespace alidade

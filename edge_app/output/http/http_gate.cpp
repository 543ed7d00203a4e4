#include "edge_app/output/http/http_gate.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <string_view>
#include <utility>

namespace alidade {
namespace {

// "host:8080" -> "host", "[::1]:8080" -> "::1"
std::string host_of(const std::string& field) {
  const std::size_t closing = field.find(']');
  if (!field.empty() && field.front() == '[' && closing != std::string::npos)
    return field.substr(1, closing - 1);
  return field.substr(0, field.find(':'));
}

bool is_address(const std::string& host) {
  boost::system::error_code error;
  boost::asio::ip::make_address(host, error);
  return !error && host.find('%') == std::string::npos;
}

}  // namespace

HttpCounters HttpTally::now() const {
  HttpCounters out;
  out.requests = requests;
  out.refused = refused;
  out.unauthorized = unauthorized;
  out.stalled = stalled;
  out.connections = connections;
  out.streams = streams;
  return out;
}

HttpGate::HttpGate(const HttpServerOptions& options, HttpTally* tally)
    : tokens_(options),
      has_tls_(options.tls.has_value()),
      own_host_(options.host),
      rate_of_strangers_(options.limits.requests_per_s),
      rate_with_token_(options.limits.requests_per_s),
      handshakes_of_strangers_(options.limits.requests_per_s),
      handshakes_of_known_(options.limits.requests_per_s),
      tally_(*tally) {}

void HttpGate::add(const std::string& method, const std::string& path, HttpRoute route) {
  routes_[path][method] = std::move(route);
}

void HttpGate::add_below(const std::string& method, const std::string& folder, HttpRoute route) {
  folders_[folder][method] = std::move(route);
}

const HttpGate::Methods* HttpGate::find(const std::string& path) const {
  if (const auto found = routes_.find(path); found != routes_.end()) return &found->second;
  const auto begins = [&path](const auto& row) { return path.rfind(row.first, 0) == 0; };
  const auto found = std::find_if(folders_.begin(), folders_.end(), begins);
  return found == folders_.end() ? nullptr : &found->second;
}

const HttpRoute* HttpGate::admit(const HttpHead& head, double now_s, bool body_to_come,
                                 HttpClient* client, ServerResponse* refusal) {
  const std::optional<HttpRight> right = tokens_.right_of(head.authorization, now_s);
  client->has_token = right.has_value();
  if (has_tls_ && client->has_token) showed_token_.add(client->address, now_s);
  client->right = right.value_or(HttpRight::kView);
  if (!body_to_come && !charge(*client, now_s, refusal)) return nullptr;
  const HttpRoute* route = nullptr;
  auto error = check(head, now_s, *client, &route);
  if (!error) return route;
  if (!body_to_come || charge(*client, now_s, refusal)) *refusal = std::move(*error);
  return nullptr;
}

bool HttpGate::may_shake_hands(const HttpAddress& address, double now_s) {
  FairRate& rate =
      showed_token_.has(address, now_s) ? handshakes_of_known_ : handshakes_of_strangers_;
  if (rate.take(address, now_s)) return true;
  ++tally_.refused;
  return false;
}

bool HttpGate::charge(const HttpClient& client, double now_s, ServerResponse* refusal) {
  FairRate& rate = client.has_token ? rate_with_token_ : rate_of_strangers_;
  if (rate.take(client.address, now_s)) return true;
  ++tally_.refused;
  *refusal = http_error(429, "too many requests; ask less often");
  refusal->headers.emplace_back("Retry-After", "1");
  return false;
}

std::optional<ServerResponse> HttpGate::check(const HttpHead& head, double now_s,
                                              const HttpClient& client, const HttpRoute** route) {
  if (!host_is_trusted(head))
    return http_error(403, "the Host header names another machine; use an address, or set a token");
  // A browser would not let that page read the answer. But each request costs work, and each stream
  // a place.
  if (!origin_is_own(head) || head.from_other_site)
    return http_error(403, "a page of another site may not ask this");
  const Methods* const methods = find(head.path);
  if (methods == nullptr) return http_error(404, "no such path; see /api/v1/openapi.yaml");
  const auto found = methods->find(head.method == "HEAD" ? "GET" : head.method);
  if (found == methods->end()) {
    ServerResponse error = http_error(405, "no such method here; see /api/v1/openapi.yaml");
    std::string allowed;
    for (const auto& [method, ignored] : *methods)
      allowed += (allowed.empty() ? "" : ", ") + (method == "GET" ? "GET, HEAD" : method);
    error.headers.emplace_back("Allow", allowed);
    return error;
  }
  *route = &found->second;
  const HttpAccess access = found->second.access;
  if (access != HttpAccess::kOpen && tokens_.any() && !client.has_token) {
    ++tally_.unauthorized;
    const bool tried = !head.authorization.empty();
    ServerResponse error =
        http_error(401, tried ? "the header Authorization shows no token of this server; expected "
                                "`Authorization: Bearer TOKEN`"
                              : "this needs the header `Authorization: Bearer TOKEN`");
    error.headers.emplace_back("WWW-Authenticate",
                               tried ? "Bearer error=\"invalid_token\"" : "Bearer");
    return error;
  }
  if (access == HttpAccess::kControl && tokens_.any() && client.right != HttpRight::kControl) {
    ++tally_.unauthorized;
    ServerResponse error = http_error(
        403, "this changes something, and the token may only view; use one that may control");
    error.headers.emplace_back("WWW-Authenticate",
                               "Bearer error=\"insufficient_scope\", scope=\"control\"");
    return error;
  }
  // A browser that loads this for a page of another site may send no Origin, and over plain HTTP
  // not even Sec-Fetch-Site.
  if (access == HttpAccess::kStream && !tokens_.any() && head.of_browser &&
      !shows_ticket(head, now_s))
    return http_error(403,
                      "a browser needs a ticket from POST /api/v1/stream/ticket for this, as "
                      "?ticket=; other clients must leave out a browser's headers, or set a token");
  return std::nullopt;
}

bool HttpGate::shows_ticket(const HttpHead& head, double now_s) {
  return std::any_of(head.parameters.begin(), head.parameters.end(), [&](const auto& parameter) {
    return parameter.first == "ticket" && tickets_.take(parameter.second, now_s);
  });
}

// Behind a proxy with TLS the page's origin is https. Without TLS here that is accepted only with a
// token, as then it does not matter who else may have that name.
bool HttpGate::origin_is_own(const HttpHead& head) const {
  return head.origin.empty() || (!has_tls_ && head.origin == "http://" + head.host) ||
         ((has_tls_ || tokens_.any()) && head.origin == "https://" + head.host);
}

// Against DNS rebinding: a page of another site whose name points to this machine. Such a page has
// no token. With TLS the certificate here does not fit its name.
bool HttpGate::host_is_trusted(const HttpHead& head) const {
  const std::string host = host_of(head.host);
  return has_tls_ || tokens_.any() || head.host.empty() || host == "localhost" ||
         host == own_host_ || is_address(host);
}

}  // namespace alidade

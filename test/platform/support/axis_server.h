#pragma once
// AxisServer: the VAPIX side of a camera on the loopback (cpp-httplib), with HTTP digest authentication
// checked as RFC 2617 says. Counts what it is asked.

#include <httplib.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <set>
#include <string>

#include "test/simulator/servers/digest_check.h"
#include "test/simulator/servers/loopback_http_server.h"

namespace alidade {

class AxisServer {
 public:
  // user empty: no authentication. port 0: any. answer makes the body of a position request.
  AxisServer(std::string user, std::string password, std::function<std::string()> answer,
             int port = 0);
  AxisServer(const AxisServer&) = delete;
  AxisServer& operator=(const AxisServer&) = delete;

  int port() const { return server_.port(); }
  std::string url() const { return server_.url(); }

  std::atomic<int> status{200};     // of a position request that is let through
  std::atomic<bool> refuse{false};  // whatever the login
  std::atomic<int> refusals{0};     // answers 401
  std::atomic<int> polls{0};        // answers to position requests that were let through
  void renew_nonce() { check_.renew_nonce(); }  // as if it had restarted
  std::string last_query() const;
  std::size_t connections() const;

 private:
  void serve_position(const httplib::Request& request, httplib::Response& response);

  DigestCheck check_;
  std::function<std::string()> answer_;
  mutable std::mutex mutex_;
  std::string last_query_;
  std::set<int> client_ports_;
  LoopbackHttpServer server_;  // last: its thread uses the others
};

}  // namespace alidade

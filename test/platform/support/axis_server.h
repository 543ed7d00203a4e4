#pragma once
// AxisServer: the VAPIX side of a camera on the loopback (cpp-httplib), with HTTP digest authentication
// checked as RFC 2617 says. Counts what it is asked.

#include <httplib.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "test/platform/support/digest_check.h"

namespace alidade {

class AxisServer {
 public:
  // user empty: no authentication. port 0: any. answer makes the body of a position request.
  AxisServer(std::string user, std::string password, std::function<std::string()> answer,
             int port = 0);
  ~AxisServer();
  AxisServer(const AxisServer&) = delete;
  AxisServer& operator=(const AxisServer&) = delete;

  int port() const { return port_; }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }

  std::atomic<int> status{200};  // of a position request that is let through
  std::atomic<int> refusals{0};  // answers 401
  std::atomic<int> polls{0};     // answers to position requests that were let through
  std::string last_query() const;
  std::size_t connections() const;

 private:
  void serve_position(const httplib::Request& request, httplib::Response& response);

  DigestCheck check_;
  std::function<std::string()> answer_;
  httplib::Server server_;
  int port_;
  mutable std::mutex mutex_;
  std::string last_query_;
  std::set<int> client_ports_;
  std::thread thread_;
};

}  // namespace alidade

#pragma once
// An HTTP server on the loopback (cpp-httplib) with a thread of its own. Handlers first, then listen(); the
// destructor ends both, so it must be the last member of what its handlers use.

#include <httplib.h>

#include <stdexcept>
#include <string>
#include <thread>

namespace alidade {

class LoopbackHttpServer {
 public:
  LoopbackHttpServer() {
    server_.set_keep_alive_max_count(1'000'000);
    server_.set_tcp_nodelay(true);
  }
  ~LoopbackHttpServer() {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }
  LoopbackHttpServer(const LoopbackHttpServer&) = delete;
  LoopbackHttpServer& operator=(const LoopbackHttpServer&) = delete;

  httplib::Server& handlers() { return server_; }

  // port 0: any. Throws where it is taken. Returns when it answers.
  void listen(int port) {
    port_ = port == 0 ? server_.bind_to_any_port("127.0.0.1") : port;
    if (port != 0 && !server_.bind_to_port("127.0.0.1", port)) {
      throw std::runtime_error("the port is taken");
    }
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) {
      std::this_thread::yield();
    }
  }

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }

 private:
  httplib::Server server_;
  int port_ = 0;
  std::thread thread_;
};

}  // namespace alidade

#include "test/platform/support/axis_server.h"

#include <stdexcept>
#include <utility>

namespace alidade {

AxisServer::AxisServer(std::string user, std::string password, std::function<std::string()> answer,
                       int port)
    : check_(std::move(user), std::move(password)), answer_(std::move(answer)) {
  server_.set_keep_alive_max_count(1'000'000);
  server_.set_tcp_nodelay(true);
  server_.Get("/axis-cgi/com/ptz.cgi",
              [this](const httplib::Request& request, httplib::Response& response) {
                serve_position(request, response);
              });
  port_ = port == 0 ? server_.bind_to_any_port("127.0.0.1") : port;
  if (port != 0 && !server_.bind_to_port("127.0.0.1", port)) {
    throw std::runtime_error("the port is taken");
  }
  thread_ = std::thread([this] { server_.listen_after_bind(); });
  while (!server_.is_running()) {
    std::this_thread::yield();
  }
}

AxisServer::~AxisServer() {
  server_.stop();
  thread_.join();
}

std::string AxisServer::last_query() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_query_;
}

std::size_t AxisServer::connections() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return client_ports_.size();
}

void AxisServer::serve_position(const httplib::Request& request, httplib::Response& response) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_query_ = request.target;
    client_ports_.insert(request.remote_port);
  }
  if (!check_.accepts("GET", request.target, request.get_header_value("Authorization"))) {
    ++refusals;
    response.status = 401;
    response.set_header("WWW-Authenticate", check_.challenge());
    return;
  }
  ++polls;
  response.status = status;
  response.set_content(answer_(), "text/plain");
}

}  // namespace alidade

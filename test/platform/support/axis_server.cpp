#include "test/platform/support/axis_server.h"

#include <utility>

namespace alidade {

AxisServer::AxisServer(std::string user, std::string password, std::function<std::string()> answer,
                       int port)
    : check_(std::move(user), std::move(password)), answer_(std::move(answer)) {
  server_.handlers().Get("/axis-cgi/com/ptz.cgi",
                         [this](const httplib::Request& request, httplib::Response& response) {
                           serve_position(request, response);
                         });
  server_.listen(port);
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
  if (refuse || !check_.accepts("GET", request.target, request.get_header_value("Authorization"))) {
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

#include "edge_app/output/http/http_server.h"

#include <poll.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/output/http/http_handlers.h"
#include "edge_app/output/http/http_listener.h"
#include "edge_app/output/http/http_tls.h"

namespace alidade {
namespace {

// A signal may end it early; the start waits again until its deadline.
bool wait_for_name(int descriptor, double timeout_s) {
  pollfd readable{descriptor, POLLIN, 0};
  static_cast<void>(::poll(&readable, 1, static_cast<int>(std::ceil(timeout_s * 1e3))));
  return true;
}

}  // namespace

HttpServer::HttpServer(const HttpServerOptions& options)
    : options_(options),
      gate_(options_, &tally_),
      listener_(std::make_unique<HttpListener>(options_, &gate_, &tally_)) {}

HttpServer::~HttpServer() { stop(); }

void HttpServer::get(const std::string& path, HttpAccess access, HttpHandler handler) {
  gate_.add("GET", path, {access, 0, std::move(handler)});
}

void HttpServer::get_below(const std::string& folder, HttpAccess access, HttpHandler handler) {
  gate_.add_below("GET", folder, {access, 0, std::move(handler)});
}

void HttpServer::post(const std::string& path, HttpAccess access, std::size_t max_body,
                      HttpHandler handler) {
  gate_.add("POST", path, {access, max_body, std::move(handler)});
}

bool HttpServer::check_tls(std::string* error) const {
  std::vector<std::string> ignored;
  if (!options_.tls || HttpTls(*options_.tls).load(error, &ignored)) return true;
  *error = "HTTP: " + *error;
  return false;
}

bool HttpServer::start(std::string* error) { return start(&wait_for_name, error); }

bool HttpServer::start(const HttpStartWait& wait, std::string* error) {
  if (!listener_->open(wait, &address_, error)) return false;
  bool started = threads_.start([this] { listener_->serve_network(); });
  for (int i = 0; i < HttpHandlers::kThreads; ++i)
    started = started && threads_.start([this] { listener_->serve_handlers(); });
  if (started) return true;
  stop();
  *error = "HTTP: cannot start a thread";
  return false;
}

void HttpServer::wake() { listener_->wake(); }

void HttpServer::stop() {
  listener_->stop();
  threads_.join();
  listener_->close();
}

}  // namespace alidade

#include "edge_app/output/http/http_server.h"

#include <string>
#include <utility>
#include <vector>

#include "edge_app/output/http/http_handlers.h"
#include "edge_app/output/http/http_listener.h"
#include "edge_app/output/http/http_tls.h"

namespace alidade {
HttpServer::HttpServer(const HttpServerOptions& options)
    : options_(options),
      gate_(options_, &tally_),
      listener_(std::make_unique<HttpListener>(options_, &gate_, &tally_)) {}

HttpServer::~HttpServer() { stop(); }

void HttpServer::get(const std::string& path, HttpAccess access, HttpHandler handler) {
  gate_.add("GET", path, {access, 0, std::move(handler)});
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

bool HttpServer::start(std::string* error) {
  if (!listener_->open(&address_, error)) return false;
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

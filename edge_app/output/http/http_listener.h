#pragma once
// HttpListener: accepts clients and lets their connections run; wakes endless answers. Where memory or descriptors have run
// out, clients are lost; it accepts again as soon as there are some.
//
// One thread runs serve_network(): all sockets, all deadlines. A few run serve_handlers().

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>

#include "edge_app/output/http/http_connection.h"
#include "edge_app/output/http/http_gate.h"
#include "edge_app/output/http/http_handlers.h"
#include "edge_app/output/http/http_options.h"
#include "edge_app/output/http/http_tls.h"

namespace alidade {

class HttpListener {
 public:
  // Borrows all of them.
  HttpListener(const HttpServerOptions& options, HttpGate* gate, HttpTally* tally);
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  // Binds and listens; *address is what was found. False with one line in *error.
  [[nodiscard]] bool open(std::string* address, std::string* error);

  // Until stop().
  void serve_network();
  void serve_handlers();

  // Any thread, at any time: endless answers may have more to say. One system call, no lock.
  void wake();

  // Ends serving. Any thread, but not beside close().
  void stop();
  // Drops all clients, once no thread serves any more.
  void close();

 private:
  struct Network;

  void serve_some();
  void accept();
  void take(boost::asio::ip::tcp::socket socket);
  void wait_for_wake();

  const HttpServerOptions& options_;
  HttpGate& gate_;
  HttpTally& tally_;
  const int wake_;  // eventfd; outlives the network, as others may write to it at any time
  std::atomic<bool> news_{false};
  std::optional<HttpTls> tls_;
  HttpPlaces places_;
  HttpHandlers handlers_;
  int accepting_ = 0;  // that wait for it; none: the last was lost
  int watching_ = 0;   // likewise for wake_
  std::unique_ptr<Network> network_;
};

}  // namespace alidade

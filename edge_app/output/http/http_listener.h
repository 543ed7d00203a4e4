#pragma once
// HttpListener: accepts clients, runs their connections and wakes endless answers. If memory or
// descriptors run out, clients are lost; the listener accepts clients again as soon as there is
// memory and a descriptor.
//
// One thread runs serve_network(): all sockets and all deadlines. HttpHandlers::kThreads threads
// run serve_handlers().

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
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
  // options, *gate and *tally must outlive this object, and options must not change. Throws
  // std::system_error if the system gives no eventfd.
  HttpListener(const HttpServerOptions& options, HttpGate* gate, HttpTally* tally);
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  // Binds and listens. *address: the address with its actual port. False as HttpServer::start().
  [[nodiscard]] bool open(const HttpStartWait& wait, std::string* address, std::string* error);

  // Both return after stop().
  void serve_network();
  void serve_handlers();

  // Any thread, at any time: endless answers may have more to send. One system call, no lock.
  void wake();

  // Ends serving. Any thread, but not at the same time as close().
  void stop();
  // Drops all clients. Only when no thread serves any more.
  void close();

 private:
  struct Network;

  [[nodiscard]] bool find_endpoint(const HttpStartWait& wait,
                                   boost::asio::ip::tcp::endpoint* endpoint,
                                   std::string* error) const;
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
  int accepting_ = 0;  // pending waits for a client; 0: the last one was lost
  int watching_ = 0;   // pending waits for wake_, likewise
  std::unique_ptr<Network> network_;
};

}  // namespace alidade

#pragma once
// HttpTransport: a client's bytes over TCP or TLS, as a stream for the library's read and write
// functions. For the network thread.

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "edge_app/output/http/http_tls.h"

namespace alidade {

class HttpTransport {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  using executor_type = Socket::executor_type;

  // tls: null for plain TCP.
  HttpTransport(Socket socket, std::shared_ptr<HttpTls::Context> tls)
      : socket_(std::move(socket)), context_(std::move(tls)) {
    if (context_) tls_.emplace(socket_, *context_);
  }
  HttpTransport(const HttpTransport&) = delete;
  HttpTransport& operator=(const HttpTransport&) = delete;

  [[nodiscard]] executor_type get_executor() { return socket_.get_executor(); }
  [[nodiscard]] bool has_tls() const { return tls_.has_value(); }
  [[nodiscard]] Socket& socket() { return socket_; }

  // Only with TLS; must come first.
  template <typename Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server,
                          [this, handler = std::forward<Handler>(handler)](
                              const boost::system::error_code& error) mutable {
                            ready_ = !error;
                            handler(error);
                          });
  }

  template <typename Buffers, typename Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_)
      tls_->async_read_some(buffers, std::forward<Handler>(handler));
    else
      socket_.async_read_some(buffers, std::forward<Handler>(handler));
  }

  template <typename Buffers, typename Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_)
      tls_->async_write_some(buffers, std::forward<Handler>(handler));
    else
      socket_.async_write_some(buffers, std::forward<Handler>(handler));
  }

  // Writes without waiting. If the client cannot take the text now, or the TLS handshake is not
  // done, the text is lost.
  void write_now(std::string_view text) {
    boost::system::error_code ignored;
    socket_.non_blocking(true, ignored);
    const auto buffer = boost::asio::buffer(text.data(), text.size());
    if (!tls_)
      socket_.write_some(buffer, ignored);
    else if (ready_)
      tls_->write_some(buffer, ignored);
  }

  // Only with TLS: says that nothing follows, and waits until the client says the same.
  template <typename Handler>
  void async_end(Handler&& handler) {
    tls_->async_shutdown(std::forward<Handler>(handler));
  }

 private:
  Socket socket_;
  std::shared_ptr<HttpTls::Context> context_;
  std::optional<boost::asio::ssl::stream<Socket&>> tls_;
  bool ready_ = false;
};

}  // namespace alidade

#include "edge_app/output/http/http_listener.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

namespace alidade {
namespace {

namespace asio = boost::asio;
using Error = boost::system::error_code;
using Tcp = asio::ip::tcp;

constexpr int kBacklog = 128;
// What the kernel keeps for a client that does not read, doubled by it: some seconds of records.
constexpr int kSendBufferBytes = 64 << 10;
// Where descriptors have run out the client stays in the queue: do not spin until something is closed.
constexpr std::chrono::milliseconds kAcceptAgain{20};

int make_event() {
  const int descriptor = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return descriptor;
}

void close_on_exec(int descriptor) { static_cast<void>(::fcntl(descriptor, F_SETFD, FD_CLOEXEC)); }

// Without waiting; a client that does not take it goes without.
void refuse(Tcp::socket* socket) {
  const std::string body = http_error(503, "too many connections").body;
  const std::string answer = fmt::format(
      "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\n"
      "Content-Length: {}\r\nConnection: close\r\n\r\n{}",
      body.size(), body);
  Error ignored;
  socket->non_blocking(true, ignored);
  socket->write_some(asio::buffer(answer), ignored);
}

// What is thrown where memory has run out ends one connection and nothing else.
void serve(asio::io_context* context) {
  while (true) {
    try {
      context->run();
      return;
    } catch (const std::exception& e) {
      spdlog::error("HTTP: connection dropped: {}", e.what());
    }
  }
}

}  // namespace

// In the order in which one needs the other.
struct HttpListener::Network {
  asio::io_context context{1};
  asio::io_context handlers;
  asio::executor_work_guard<asio::io_context::executor_type> work{handlers.get_executor()};
  Tcp::acceptor acceptor{context};
  asio::steady_timer accept_again{context};
  asio::posix::stream_descriptor wake{context};
};

HttpListener::HttpListener(const HttpServerOptions& options, HttpGate* gate, HttpTally* tally)
    : options_(options),
      gate_(*gate),
      tally_(*tally),
      wake_(make_event()),
      network_(std::make_unique<Network>()) {}

HttpListener::~HttpListener() {
  close();
  ::close(wake_);
}

bool HttpListener::open(std::string* address, std::string* error) {
  const std::string where = fmt::format("{}:{}", options_.host, options_.port);
  Error code;
  Tcp::resolver resolver(network_->context);
  const auto found =
      resolver.resolve(options_.host, std::to_string(options_.port),
                       Tcp::resolver::passive | Tcp::resolver::numeric_service, code);
  if (code || found.empty()) {
    *error = fmt::format("HTTP: cannot listen on {}: {}; give an address of this machine", where,
                         code.message());
    return false;
  }
  const Tcp::endpoint endpoint = found.begin()->endpoint();
  Tcp::acceptor& acceptor = network_->acceptor;
  acceptor.open(endpoint.protocol(), code);
  if (!code) close_on_exec(acceptor.native_handle());
  if (!code) acceptor.set_option(Tcp::acceptor::reuse_address(true), code);
  if (!code) acceptor.bind(endpoint, code);
  if (!code) acceptor.listen(kBacklog, code);
  if (code) {
    *error = fmt::format(
        "HTTP: cannot listen on {}: {}{}", where, code.message(),
        code == asio::error::address_in_use ? "; another program does, choose another port" : "");
    return false;
  }
  std::ostringstream text;
  text << acceptor.local_endpoint(code);
  *address = text.str();
  network_->wake.assign(::fcntl(wake_, F_DUPFD_CLOEXEC, 0), code);
  if (code) {
    *error = fmt::format("HTTP: {}", code.message());
    return false;
  }
  wait_for_wake();
  accept();
  return true;
}

void HttpListener::serve_network() { serve(&network_->context); }
void HttpListener::serve_handlers() { serve(&network_->handlers); }

HttpService HttpListener::service() {
  return {options_.limits, gate_, tally_, network_->handlers, streams_};
}

void HttpListener::accept() {
  network_->acceptor.async_accept([this](const Error& error, Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {
      network_->accept_again.expires_after(kAcceptAgain);
      network_->accept_again.async_wait([this](const Error& ended) {
        if (!ended) accept();
      });
      return;
    }
    accept();
    take(std::move(socket));
  });
}

void HttpListener::take(Tcp::socket socket) {
  close_on_exec(socket.native_handle());
  Error ignored;
  socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  socket.set_option(Tcp::no_delay(true), ignored);
  if (tally_.connections >= options_.limits.max_connections) {
    ++tally_.refused;
    refuse(&socket);
    return;
  }
  std::make_shared<HttpConnection>(std::move(socket), service())->begin();
}

void HttpListener::wait_for_wake() {
  network_->wake.async_wait(asio::posix::stream_descriptor::wait_read, [this](const Error& error) {
    if (error) return;
    eventfd_t count = 0;
    static_cast<void>(::eventfd_read(wake_, &count));
    wait_for_wake();
    // One may end while it is woken.
    std::vector<std::shared_ptr<HttpConnection>> woken;
    for (HttpConnection* stream : streams_) woken.push_back(stream->shared_from_this());
    for (const auto& stream : woken) stream->wake();
  });
}

void HttpListener::wake() { static_cast<void>(::eventfd_write(wake_, 1)); }

void HttpListener::stop() {
  if (network_ == nullptr) return;
  network_->context.stop();
  network_->handlers.stop();
}

// The contexts drop what waits in them, and so the connections.
void HttpListener::close() { network_.reset(); }

}  // namespace alidade

#include "edge_app/output/http/http_listener.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "platform/system/clock.h"
#include "platform/system/name_lookup.h"

namespace alidade {
namespace {

namespace asio = boost::asio;
using Error = boost::system::error_code;
using Tcp = asio::ip::tcp;

constexpr int kBacklog = 1024;
// The kernel's buffer for a client that does not read, some seconds of records. The kernel doubles
// it.
constexpr int kSendBufferBytes = 64 << 10;
// Without free descriptors the client stays in the queue. The pause keeps the thread from spinning
// until something is closed.
constexpr std::chrono::milliseconds kAcceptAgain{20};
constexpr double kSilenceS = 10;  // after a failure was logged
constexpr double kNameDeadlineS = 5;

int make_event() {
  const int descriptor = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return descriptor;
}

void close_on_exec(int descriptor) { static_cast<void>(::fcntl(descriptor, F_SETFD, FD_CLOEXEC)); }

// Counts pending waits. A wait stops counting when it ends and when it is lost: the library drops a
// wait for which it has no memory.
class Waiting {
 public:
  explicit Waiting(int* count) : count_(count) { ++*count_; }
  Waiting(Waiting&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  Waiting& operator=(Waiting&&) = delete;
  ~Waiting() {
    if (count_ != nullptr) --*count_;
  }

 private:
  int* count_;
};

// Logging may fail, too, when memory has run out.
void say_failure(const char* what) noexcept {
  try {
    spdlog::error("HTTP: connection dropped: {}", what);
  } catch (...) {
    return;
  }
}

}  // namespace

// Members in the order of construction: each needs those before it.
struct HttpListener::Network {
  asio::io_context context{1};
  Tcp::acceptor acceptor{context};
  asio::steady_timer accept_again{context};
  asio::posix::stream_descriptor wake{context};
};

HttpListener::HttpListener(const HttpServerOptions& options, HttpGate* gate, HttpTally* tally)
    : options_(options),
      gate_(*gate),
      tally_(*tally),
      wake_(make_event()),
      places_(options.limits),
      handlers_(wake_),
      network_(std::make_unique<Network>()) {
  if (options.tls) tls_.emplace(*options.tls);
}

HttpListener::~HttpListener() {
  close();
  ::close(wake_);
}

// False as HttpServer::start().
bool HttpListener::find_endpoint(const HttpStartWait& wait, Tcp::endpoint* endpoint,
                                 std::string* error) const {
  const auto refuse = [&](const std::string& why) {
    *error = fmt::format("HTTP: cannot listen on {}:{}: {}; give an address of this machine",
                         options_.host, options_.port, why);
    return false;
  };
  NameLookup lookup(options_.host, std::to_string(options_.port), SOCK_STREAM);
  if (!lookup.begin()) return refuse("there can be no thread to look up its name");
  const double deadline_s = monotonic_now_s() + kNameDeadlineS;
  while (!lookup.is_over()) {
    const double left_s = deadline_s - monotonic_now_s();
    if (left_s <= 0)
      return refuse(fmt::format("its name was not found within {:g} s", kNameDeadlineS));
    if (!wait(lookup.descriptor(), left_s)) return false;
  }
  std::string why;
  const std::vector<HostAddress> found = lookup.take(&why);
  if (found.empty() || found.front().size > endpoint->capacity()) return refuse(why);
  std::memcpy(endpoint->data(), found.front().get(), found.front().size);
  endpoint->resize(found.front().size);
  return true;
}

bool HttpListener::open(const HttpStartWait& wait, std::string* address, std::string* error) {
  if (tls_) {
    std::vector<std::string> warnings;
    if (!tls_->load(error, &warnings)) {
      *error = "HTTP: " + *error;
      return false;
    }
    for (const std::string& warning : warnings) spdlog::warn("HTTP: {}", warning);
  }
  Tcp::endpoint endpoint;
  if (!find_endpoint(wait, &endpoint, error)) return false;
  Error code;
  Tcp::acceptor& acceptor = network_->acceptor;
  acceptor.open(endpoint.protocol(), code);
  if (!code) close_on_exec(acceptor.native_handle());
  if (!code) acceptor.set_option(Tcp::acceptor::reuse_address(true), code);
  if (!code) acceptor.bind(endpoint, code);
  if (!code) acceptor.listen(kBacklog, code);
  if (code) {
    *error = fmt::format(
        "HTTP: cannot listen on {}:{}: {}{}", options_.host, options_.port, code.message(),
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

// An exception, as when memory has run out, ends one connection and nothing else.
void HttpListener::serve_network() {
  double silent_until_s = 0;
  while (!network_->context.stopped()) {
    try {
      serve_some();
    } catch (const std::exception& e) {
      if (monotonic_now_s() < silent_until_s) continue;
      silent_until_s = monotonic_now_s() + kSilenceS;
      say_failure(e.what());
    }
  }
}

void HttpListener::serve_some() {
  try {
    if (watching_ == 0) {
      wait_for_wake();
      static_cast<void>(::eventfd_write(wake_, 1));  // do what was due when the wait was lost
    }
    if (accepting_ == 0) accept();
  } catch (...) {
    std::this_thread::sleep_for(kAcceptAgain);
    throw;
  }
  network_->context.run();
}

void HttpListener::serve_handlers() { handlers_.serve(); }

void HttpListener::accept() {
  network_->acceptor.async_accept([this, waiting = Waiting(&accepting_)](const Error& error,
                                                                         Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {
      network_->accept_again.expires_after(kAcceptAgain);
      network_->accept_again.async_wait([this, again = Waiting(&accepting_)](const Error& ended) {
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
  Error error;
  const Tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return;  // the client has gone already
  socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), error);
  socket.set_option(Tcp::no_delay(true), error);
  const HttpAddress address = http_address(peer.address());
  const double now_s = monotonic_now_s();
  std::shared_ptr<HttpTls::Context> tls;
  if (tls_) {
    // A handshake costs more than most requests, so it is limited, too.
    if (!gate_.may_shake_hands(address, now_s)) return;
    tls = tls_->context(now_s);
  }
  const HttpService service{options_.limits, gate_, tally_, handlers_, places_};
  std::make_shared<HttpConnection>(std::move(socket), std::move(tls), address, service)->begin();
}

void HttpListener::wait_for_wake() {
  network_->wake.async_wait(asio::posix::stream_descriptor::wait_read,
                            [this, waiting = Waiting(&watching_)](const Error& error) {
                              if (error) return;
                              eventfd_t count = 0;
                              static_cast<void>(::eventfd_read(wake_, &count));
                              wait_for_wake();
                              handlers_.collect();
                              if (!news_.exchange(false)) return;
                              // Keep them alive: a stream may end while it is woken.
                              std::vector<std::shared_ptr<HttpConnection>> woken;
                              places_.streams.for_each([&](HttpConnection* stream) {
                                woken.push_back(stream->shared_from_this());
                              });
                              for (const auto& stream : woken) stream->wake();
                            });
}

void HttpListener::wake() {
  news_ = true;
  static_cast<void>(::eventfd_write(wake_, 1));
}

void HttpListener::stop() {
  if (network_ == nullptr) return;
  network_->context.stop();
  handlers_.stop();
}

// The context drops its pending operations, and with them the connections.
void HttpListener::close() {
  handlers_.clear();
  network_.reset();
}

}  // namespace alidade

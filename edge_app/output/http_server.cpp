#include "edge_app/output/http_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <strings.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>

#include "platform/system/clock.h"

namespace alidade {
namespace {

constexpr int kNiceness = 10;
// A handler's frames are small; with locked memory every byte of every thread's stack is resident.
constexpr std::size_t kStackBytes = std::size_t{512} << 10;
constexpr double kWholeAnswerS = 60;  // the longest that one finite answer may take
constexpr double kLingerS = 1;        // for what a refused client is still sending
constexpr std::size_t kLingerBytes = std::size_t{256} << 10;
// What the kernel keeps for a client that does not read, doubled by it: some seconds of records.
constexpr int kSendBuffer = 64 << 10;

const char* reason(int status) {
  switch (status) {
    case 408:
      return "Request Timeout";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

// A descriptor that is closed once.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void reset(int value) {
    if (value_ >= 0) ::close(value_);
    value_ = value;
  }
  [[nodiscard]] int get() const { return value_; }

 private:
  int value_;
};

// One client's socket, as cpp-httplib reads and writes it: with deadlines, and open no longer than the server.
class Connection final : public httplib::Stream {
 public:
  enum class Head { kComplete, kTooLarge, kTooLate, kGone };

  Connection(int socket, int stopping, const HttpLimits& limits)
      : socket_(socket), stopping_(stopping), limits_(limits) {}

  // Reads to the blank line.
  Head read_head() {
    const double deadline_s = monotonic_now_s() + limits_.head_timeout_s;
    std::size_t searched = 0;
    while (true) {
      const std::size_t end = received_.find("\r\n\r\n", searched);
      if (end != std::string::npos) {
        ignore_range(end);
        body_deadline_s_ = monotonic_now_s() + limits_.body_timeout_s;
        return Head::kComplete;
      }
      if (received_.size() >= limits_.max_head_bytes) return Head::kTooLarge;
      searched = received_.size() < 3 ? 0 : received_.size() - 3;
      std::array<char, 2048> piece{};
      const std::size_t room = std::min(piece.size(), limits_.max_head_bytes - received_.size());
      const ssize_t count = receive(piece.data(), room, deadline_s);
      if (count <= 0) return received_.empty() || !late_ ? Head::kGone : Head::kTooLate;
      received_.append(piece.data(), static_cast<std::size_t>(count));
    }
  }

  [[nodiscard]] bool is_readable() const override { return !dead_; }
  [[nodiscard]] bool is_writable() const override { return !dead_; }

  ssize_t read(char* to, std::size_t size) override {
    if (taken_ < received_.size()) {
      const std::size_t count = std::min(size, received_.size() - taken_);
      std::memcpy(to, received_.data() + taken_, count);
      taken_ += count;
      return static_cast<ssize_t>(count);
    }
    return receive(to, size, body_deadline_s_);
  }

  ssize_t write(const char* from, std::size_t size) override {
    if (answer_deadline_s_ == 0) answer_deadline_s_ = monotonic_now_s() + kWholeAnswerS;
    std::size_t sent = 0;
    while (sent < size && !dead_) {
      const ssize_t count = ::send(socket_, from + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count >= 0) {
        sent += static_cast<std::size_t>(count);
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        const double now_s = monotonic_now_s();
        dead_ = !wait(POLLOUT, std::min(now_s + limits_.write_timeout_s, answer_deadline_s_));
        stalled_ = dead_ && late_;
      } else if (errno != EINTR) {
        dead_ = true;
      }
    }
    return dead_ ? -1 : static_cast<ssize_t>(size);
  }

  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip.clear();
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    ip.clear();
    port = 0;
  }
  [[nodiscard]] socket_t socket() const override { return socket_; }

  // From now on an answer may take for ever, if only it moves.
  void set_endless() { answer_deadline_s_ = std::numeric_limits<double>::infinity(); }
  [[nodiscard]] bool stalled() const { return stalled_; }

  // Lets a client that is still sending read its answer: closing at once would reset the connection.
  void linger() {
    if (dead_ || ::shutdown(socket_, SHUT_WR) != 0) return;
    const double deadline_s = monotonic_now_s() + kLingerS;
    std::array<char, 4096> piece{};
    for (std::size_t read = 0; read < kLingerBytes;) {
      const ssize_t count = receive(piece.data(), piece.size(), deadline_s);
      if (count <= 0) return;
      read += static_cast<std::size_t>(count);
    }
  }

 private:
  void ignore_range(std::size_t end) {
    for (std::size_t line = received_.find("\r\n"); line < end;
         line = received_.find("\r\n", line + 2)) {
      if (::strncasecmp(received_.data() + line + 2, "range", 5) == 0) received_[line + 2] = 'x';
    }
  }

  // What comes first: bytes (> 0), the client's end (0), or the deadline, an error, the end of the server (-1).
  ssize_t receive(char* to, std::size_t size, double deadline_s) {
    while (true) {
      const ssize_t count = ::recv(socket_, to, size, MSG_DONTWAIT);
      if (count >= 0) return count;
      if (errno == EINTR) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) return -1;
      if (!wait(POLLIN, deadline_s)) return -1;
    }
  }

  // False: the deadline has passed (late_), or the server stops.
  bool wait(short events, double deadline_s) {
    while (true) {
      const double left_s = deadline_s - monotonic_now_s();
      late_ = left_s <= 0;
      if (late_) return false;
      std::array<pollfd, 2> descriptors{{{socket_, events, 0}, {stopping_, POLLIN, 0}}};
      const int timeout_ms = static_cast<int>(std::min(1e3 * left_s + 1, 1e6));
      const int ready = ::poll(descriptors.data(), descriptors.size(), timeout_ms);
      if (ready < 0 && errno != EINTR) return false;
      if (descriptors[1].revents != 0) return false;
      if (ready > 0 && descriptors[0].revents != 0) return true;
    }
  }

  int socket_;
  int stopping_;
  const HttpLimits& limits_;
  std::string received_;   // the head, and what came with it
  std::size_t taken_ = 0;  // of it
  double body_deadline_s_ = 0;
  double answer_deadline_s_ = 0;  // 0: nothing was answered yet
  bool late_ = false;
  bool stalled_ = false;
  bool dead_ = false;
};

class Pieces final : public HttpStream {
 public:
  explicit Pieces(Connection* to) : to_(to) {}
  bool write(const std::string& piece) override {
    return to_->write(piece.data(), piece.size()) >= 0;
  }

 private:
  Connection* to_;
};

// As many requests as have been earned since the last, at most a second's worth.
class RateLimit {
 public:
  explicit RateLimit(double per_s) : per_s_(per_s), most_(std::max(1.0, per_s)), left_(most_) {}
  bool take(double now_s) {
    const std::lock_guard<std::mutex> lock(mutex_);
    left_ = std::min(most_, left_ + per_s_ * std::max(0.0, now_s - last_s_));
    last_s_ = now_s;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  std::mutex mutex_;
  const double per_s_;
  const double most_;
  double left_;
  double last_s_ = 0;
};

// Looks at all of what was given, wherever it first differs.
bool is_token(const std::string& given, const std::string& token) {
  std::size_t difference = given.size() ^ token.size();
  for (std::size_t i = 0; i < given.size(); ++i) {
    difference |= static_cast<std::size_t>(static_cast<unsigned char>(given[i]) ^
                                           static_cast<unsigned char>(token[i % token.size()]));
  }
  return difference == 0;
}

// "host:8080" -> "host", "[::1]:8080" -> "::1"
std::string host_of(const std::string& header) {
  const std::size_t closing = header.find(']');
  if (!header.empty() && header.front() == '[' && closing != std::string::npos)
    return header.substr(1, closing - 1);
  return header.substr(0, header.find(':'));
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> buffer{};
  return ::inet_pton(AF_INET, host.c_str(), buffer.data()) == 1 ||
         ::inet_pton(AF_INET6, host.c_str(), buffer.data()) == 1;
}

struct Route {
  HttpAccess access = HttpAccess::kToken;
  std::size_t max_body = 0;
  HttpHandler handler;
};

std::string escaped(const std::string& path) {
  std::string pattern;
  for (const char c : path) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '/') pattern += '\\';
    pattern += c;
  }
  return pattern;
}

std::string printable(const sockaddr* address, socklen_t length) {
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  ::getnameinfo(address, length, host.data(), host.size(), port.data(), port.size(),
                NI_NUMERICHOST | NI_NUMERICSERV);
  return fmt::format(address->sa_family == AF_INET6 ? "[{}]:{}" : "{}:{}", host.data(),
                     port.data());
}

}  // namespace

std::optional<std::string> ServerRequest::parameter(const std::string& name) const {
  for (const auto& [key, value] : parameters) {
    if (key == name) return value;
  }
  return std::nullopt;
}

ServerResponse http_error(int status, const std::string& line) {
  ServerResponse response;
  response.status = status;
  response.body = nlohmann::json{{"error", line}}.dump(-1, ' ', true,
                                                       nlohmann::json::error_handler_t::replace) +
                  "\n";
  return response;
}

class HttpServer::Impl final : public httplib::Server {
 public:
  explicit Impl(const HttpServerOptions& options)
      : options_(options),
        rate_(options.limits.requests_per_s),
        stopping_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (stopping_.get() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      return handle_head(request, &response);
    });
    set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (!response.body.empty()) return;
      response.set_content(http_error(response.status, "malformed request").body,
                           "application/json");
    });
    set_exception_handler([](const httplib::Request&, httplib::Response& response,
                             const std::exception_ptr& thrown) {
      try {
        std::rethrow_exception(thrown);
      } catch (const std::exception& e) {
        spdlog::error("HTTP: {}", e.what());
      } catch (...) {
        spdlog::error("HTTP: unknown failure");
      }
      response.status = 500;
      response.set_content(http_error(500, "internal error; see the log").body, "application/json");
    });
  }

  ~Impl() override { stop(); }

  void add(const char* method, const std::string& path, Route route) {
    if (std::strcmp(method, "POST") == 0) {
      Post(escaped(path),
           [this, path](const httplib::Request& request, httplib::Response& response) {
             answer(routes_.at(path).at("POST"), request, &response);
           });
    }
    routes_[path][method] = std::move(route);
  }

  bool start(std::string* error) {
    if (!listen_at(error)) return false;
    accepting_ = start_thread(&acceptor_, [](void* self) -> void* {
      static_cast<Impl*>(self)->accept_connections();
      return nullptr;
    });
    if (!accepting_) *error = "HTTP: cannot start a thread";
    return accepting_;
  }

  void stop() {
    ::eventfd_write(stopping_.get(), 1);
    svr_sock_ = INVALID_SOCKET;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    if (on_stop) on_stop();
    wake_.notify_all();
    // After whose end there are no new ones.
    if (accepting_) ::pthread_join(acceptor_, nullptr);
    accepting_ = false;
    for (const pthread_t thread : threads_) ::pthread_join(thread, nullptr);
    threads_.clear();
    for (const int socket : waiting_) ::close(socket);
    waiting_.clear();
    listening_.reset(-1);
  }

  [[nodiscard]] HttpCounters counters() const {
    HttpCounters out;
    out.requests = requests_;
    out.refused = refused_;
    out.unauthorized = unauthorized_;
    out.stalled = stalled_;
    out.connections = connections_;
    out.streams = streams_;
    return out;
  }

  [[nodiscard]] const std::string& address() const { return address_; }

  std::function<void()> on_stop;

 private:
  bool listen_at(std::string* error) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
    addrinfo* found = nullptr;
    const std::string where = fmt::format("{}:{}", options_.host, options_.port);
    const int problem =
        ::getaddrinfo(options_.host.c_str(), std::to_string(options_.port).c_str(), &hints, &found);
    if (problem != 0) {
      *error = fmt::format("HTTP: cannot listen on {}: {}; give an address of this machine", where,
                           ::gai_strerror(problem));
      return false;
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
    listening_.reset(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const int on = 1;
    constexpr int kBacklog = 128;
    const bool listens =
        listening_.get() >= 0 &&
        ::setsockopt(listening_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
        ::bind(listening_.get(), found->ai_addr, found->ai_addrlen) == 0 &&
        ::listen(listening_.get(), kBacklog) == 0;
    if (!listens) {
      const int code = errno;
      *error = fmt::format("HTTP: cannot listen on {}: {}{}", where,
                           std::generic_category().message(code),
                           code == EADDRINUSE ? "; another program does, choose another port" : "");
      return false;
    }
    sockaddr_storage bound{};
    socklen_t length = sizeof bound;
    auto* generic = reinterpret_cast<sockaddr*>(&bound);
    if (::getsockname(listening_.get(), generic, &length) == 0)
      address_ = printable(generic, length);
    svr_sock_ = listening_.get();
    return true;
  }

  bool start_thread(pthread_t* thread, void* (*run)(void*)) {
    pthread_attr_t attributes;
    ::pthread_attr_init(&attributes);
    ::pthread_attr_setstacksize(&attributes, kStackBytes);
    // Whatever the thread that starts it runs as.
    const sched_param none{};
    ::pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    ::pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
    ::pthread_attr_setschedparam(&attributes, &none);
    const int error = ::pthread_create(thread, &attributes, run, this);
    ::pthread_attr_destroy(&attributes);
    return error == 0;
  }

  void accept_connections() {
    // Of this thread alone, on Linux.
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNiceness));
    while (true) {
      std::array<pollfd, 2> descriptors{
          {{listening_.get(), POLLIN, 0}, {stopping_.get(), POLLIN, 0}}};
      static_cast<void>(::poll(descriptors.data(), descriptors.size(), -1));
      if (descriptors[1].revents != 0) return;
      const int socket =
          ::accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (socket >= 0) {
        take(socket);
      } else if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
        // The client stays in the queue: do not spin until something is closed.
        constexpr int kPauseMs = 20;
        static_cast<void>(::poll(&descriptors[1], 1, kPauseMs));
      }
    }
  }

  // Hands a connection to a thread that has nothing to do, or to a new one.
  void take(int socket) {
    static_cast<void>(
        ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer));
    const int on = 1;
    static_cast<void>(::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (connections_ < options_.limits.max_connections) {
        ++connections_;
        waiting_.push_back(socket);
        if (idle_ >= waiting_.size() || grow() || !threads_.empty()) {
          wake_.notify_one();
          return;
        }
        waiting_.pop_back();
        --connections_;
      }
    }
    refuse(socket, 503, "too many connections");
    ::close(socket);
  }

  bool grow() {
    pthread_t thread{};
    const bool started = start_thread(&thread, [](void* self) -> void* {
      static_cast<Impl*>(self)->serve_connections();
      return nullptr;
    });
    if (started) threads_.push_back(thread);
    return started;
  }

  void serve_connections() {
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNiceness));
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      ++idle_;
      wake_.wait(lock, [this] { return stopped_ || !waiting_.empty(); });
      --idle_;
      if (stopped_) return;
      const int socket = waiting_.front();
      waiting_.pop_front();
      lock.unlock();
      // What is thrown beyond a handler, as where memory has run out, ends this connection and nothing else.
      try {
        serve(socket);
      } catch (const std::exception& e) {
        spdlog::error("HTTP: connection dropped: {}", e.what());
      }
      ::close(socket);
      lock.lock();
      --connections_;
    }
  }

  void serve(int socket) {
    Connection connection(socket, stopping_.get(), options_.limits);
    switch (connection.read_head()) {
      case Connection::Head::kGone:
        return;
      case Connection::Head::kTooLate:
        refuse(socket, 408, "the request did not come in time");
        break;
      case Connection::Head::kTooLarge:
        refuse(socket, 431, "the request's head is too large");
        break;
      case Connection::Head::kComplete: {
        ++requests_;
        serving_ = &connection;
        bool closed = true;
        process_request(connection, true, closed, [](httplib::Request& request) {
          // Neither compressed answers nor forms and multipart bodies, which the library would take apart.
          request.headers.erase("Accept-Encoding");
          request.headers.erase("Content-Type");
          // Without a length there is no body; the library would wait for the connection's end.
          if (!request.has_header("Content-Length") && !request.has_header("Transfer-Encoding"))
            request.set_header("Content-Length", "0");
        });
        serving_ = nullptr;
        break;
      }
    }
    connection.linger();
    if (connection.stalled()) ++stalled_;
  }

  // Without waiting; a client that does not take it goes without.
  void refuse(int socket, int status, const char* line) {
    ++refused_;
    const std::string body = http_error(status, line).body;
    const std::string answer = fmt::format(
        "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n"
        "Connection: close\r\n\r\n{}",
        status, reason(status), body.size(), body);
    static_cast<void>(::send(socket, answer.data(), answer.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }

  // All that can be said before the body is read.
  httplib::Server::HandlerResponse handle_head(const httplib::Request& request,
                                               httplib::Response* response) {
    const auto path = routes_.find(request.path);
    const bool head = request.method == "HEAD";
    const Route* route = nullptr;
    if (path != routes_.end()) {
      const auto method = path->second.find(head ? "GET" : request.method);
      if (method != path->second.end()) route = &method->second;
    }
    std::optional<ServerResponse> error;
    if (!rate_.take(monotonic_now_s())) {
      ++refused_;
      error = http_error(429, "too many requests; ask less often");
    } else if (!host_is_trusted(request)) {
      error =
          http_error(403, "the Host header names another machine; use an address, or set a token");
    } else if (path == routes_.end()) {
      error = http_error(404, "no such path; see /api/v1/openapi.yaml");
    } else if (route == nullptr) {
      error = http_error(405, "no such method here; see /api/v1/openapi.yaml");
      std::string allowed;
      for (const auto& [method, ignored] : path->second)
        allowed += (allowed.empty() ? "" : ", ") + method;
      error->headers.emplace_back("Allow", allowed);
    } else if (route->access == HttpAccess::kToken && !has_token(request)) {
      ++unauthorized_;
      error = http_error(401, "this needs the header `Authorization: Bearer TOKEN`");
      error->headers.emplace_back("WWW-Authenticate", "Bearer");
    } else if (request.method == "POST") {
      error = check_post(request, *route);
    }
    if (error) {
      fill(std::move(*error), response);
      return HandlerResponse::Handled;
    }
    if (request.method == "POST") return HandlerResponse::Unhandled;
    answer(*route, request, response);
    return HandlerResponse::Handled;
  }

  [[nodiscard]] bool has_token(const httplib::Request& request) const {
    if (options_.token.empty()) return true;
    constexpr const char* kScheme = "Bearer ";
    const std::string given = request.get_header_value("Authorization");
    return given.compare(0, std::strlen(kScheme), kScheme) == 0 &&
           is_token(given.substr(std::strlen(kScheme)), options_.token);
  }

  // A token cannot be had by a page of another site, whatever name that site takes.
  [[nodiscard]] bool host_is_trusted(const httplib::Request& request) const {
    const std::string header = request.get_header_value("Host");
    const std::string host = host_of(header);
    return !options_.token.empty() || header.empty() || host == "localhost" ||
           host == options_.host || is_address(host);
  }

  static std::optional<ServerResponse> check_post(const httplib::Request& request,
                                                  const Route& route) {
    const std::string origin = request.get_header_value("Origin");
    if (!origin.empty() && origin != "http://" + request.get_header_value("Host"))
      return http_error(403, "a page of another site may not ask this");
    if (request.has_header("Transfer-Encoding") ||
        request.get_header_value_count("Content-Length") != 1)
      return http_error(411, "the request must tell the length of its body, once");
    if (request.has_header("Content-Encoding"))
      return http_error(415, "the body must not be compressed");
    const std::string length = request.get_header_value("Content-Length");
    constexpr std::size_t kDigits = 9;
    if (length.empty() || length.find_first_not_of("0123456789") != std::string::npos)
      return http_error(400, "Content-Length is not a number");
    if (length.size() > kDigits || std::stoul(length) > route.max_body) {
      return http_error(413,
                        fmt::format("the body is too large; at most {} bytes", route.max_body));
    }
    return std::nullopt;
  }

  void answer(const Route& route, const httplib::Request& request, httplib::Response* response) {
    ServerRequest ours;
    ours.method = request.method;
    ours.path = request.path;
    ours.body = request.body;
    ours.parameters.assign(request.params.begin(), request.params.end());
    fill(route.handler(ours), response);
  }

  void fill(ServerResponse from, httplib::Response* to) {
    if (from.stream && ++streams_ > options_.limits.max_streams) {
      --streams_;
      ++refused_;
      from = http_error(503, "too many streams");
    }
    to->status = from.status;
    for (const auto& [name, value] : from.headers) to->set_header(name, value);
    if (!to->has_header("Cache-Control")) to->set_header("Cache-Control", "no-store");
    to->set_header("X-Content-Type-Options", "nosniff");
    if (!from.stream) {
      to->set_content(std::move(from.body), from.type);
      return;
    }
    Connection* connection = serving_;
    connection->set_endless();
    to->set_content_provider(
        from.type,
        [stream = std::move(from.stream), connection](std::size_t, httplib::DataSink& sink) {
          Pieces pieces(connection);
          stream(pieces);
          sink.done();
          return true;
        },
        [this](bool) { --streams_; });
  }

  static thread_local Connection* serving_;  // by this thread

  const HttpServerOptions options_;
  RateLimit rate_;
  std::map<std::string, std::map<std::string, Route>> routes_;  // by path and method
  Descriptor stopping_;  // eventfd: readable once the server stops
  Descriptor listening_;
  std::string address_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<int> waiting_;  // connections that no thread has taken up yet
  std::size_t idle_ = 0;
  bool stopped_ = false;
  pthread_t acceptor_{};
  bool accepting_ = false;
  std::vector<pthread_t> threads_;  // that the acceptor has started

  std::atomic<std::int64_t> requests_{0};
  std::atomic<std::int64_t> refused_{0};
  std::atomic<std::int64_t> unauthorized_{0};
  std::atomic<std::int64_t> stalled_{0};
  std::atomic<std::int64_t> connections_{0};
  std::atomic<std::int64_t> streams_{0};
};

thread_local Connection* HttpServer::Impl::serving_ = nullptr;

HttpServer::HttpServer(const HttpServerOptions& options) : impl_(std::make_unique<Impl>(options)) {}
HttpServer::~HttpServer() = default;

void HttpServer::get(const std::string& path, HttpAccess access, HttpHandler handler) {
  impl_->add("GET", path, {access, 0, std::move(handler)});
}

void HttpServer::post(const std::string& path, HttpAccess access, std::size_t max_body,
                      HttpHandler handler) {
  impl_->add("POST", path, {access, max_body, std::move(handler)});
}

bool HttpServer::start(std::string* error) { return impl_->start(error); }
std::string HttpServer::address() const { return impl_->address(); }
void HttpServer::stop() { impl_->stop(); }
void HttpServer::set_on_stop(std::function<void()> on_stop) { impl_->on_stop = std::move(on_stop); }
HttpCounters HttpServer::counters() const { return impl_->counters(); }

}  // namespace alidade

#include "edge_app/output/http/http_connection.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/beast/http/status.hpp>
#include <chrono>
#include <limits>
#include <utility>

#include "platform/system/clock.h"

namespace alidade {
namespace {

namespace asio = boost::asio;

constexpr double kAskAgainS = 0.01;  // pause if a handler has no answer yet
constexpr double kSayAgainS = 0.5;   // pause if an endless answer has nothing to send
constexpr double kCancelAgainS = 0.05;
constexpr int kCancelTimes = 5;
constexpr double kWholeAnswerS = 60;  // longest time for a finite answer
constexpr double kLingerS = 1;        // for bytes that a client still sends after its answer
constexpr std::size_t kLingerBytes = std::size_t{256} << 10;
constexpr std::size_t kLingerPiece = 4096;
// Constant, so that it can be sent when memory is short.
constexpr std::string_view kTooMany =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nRetry-After: 1\r\n"
    "Content-Length: 33\r\nConnection: close\r\n\r\n{\"error\":\"too many connections\"}\n";
constexpr std::string_view kPlainHttp =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: application/json\r\nContent-Length: 56\r\n"
    "Connection: close\r\n\r\n{\"error\":\"this server speaks TLS; ask it for https://\"}\n";
constexpr char kContinue[] = "HTTP/1.1 100 Continue\r\n\r\n";

bool has_header(const ServerResponse& response, const char* name) {
  return std::any_of(response.headers.begin(), response.headers.end(),
                     [name](const auto& header) { return header.first == name; });
}

std::string head_of(const ServerResponse& response) {
  namespace http = boost::beast::http;
  const auto status = static_cast<unsigned>(response.status);
  const auto reason = http::obsolete_reason(http::int_to_status(status));
  std::string text = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nConnection: close\r\n"
      "X-Content-Type-Options: nosniff\r\n",
      status, std::string(reason.data(), reason.size()), response.type);
  for (const auto& [name, value] : response.headers) text += fmt::format("{}: {}\r\n", name, value);
  if (!has_header(response, "Cache-Control")) text += "Cache-Control: no-store\r\n";
  if (!response.stream) text += fmt::format("Content-Length: {}\r\n", response.body.size());
  return text + "\r\n";
}

void log_failure(const char* what) { spdlog::error("HTTP: {}", what); }

// An exception of a handler goes to the log, not to the client.
std::optional<ServerResponse> call(const HttpHandler& handler, const ServerRequest& request) {
  try {
    return handler(request);
  } catch (const std::exception& e) {
    log_failure(e.what());
  } catch (...) {
    log_failure("unknown failure");
  }
  return http_error(500, "internal error; see the log");
}

}  // namespace

HttpConnection::HttpConnection(asio::ip::tcp::socket socket, std::shared_ptr<HttpTls::Context> tls,
                               const HttpAddress& address, const HttpService& service)
    : transport_(std::move(socket), std::move(tls)),
      timer_(transport_.get_executor()),
      service_(service),
      client_{address, false} {
  ++service_.tally.connections;
}

HttpConnection::~HttpConnection() {
  leave_place();
  --service_.tally.connections;
}

template <typename Stage>
void HttpConnection::guarded(Stage stage) {
  if (ended_) return;
  try {
    stage();
  } catch (...) {
    drop();
    throw;
  }
}

void HttpConnection::begin() {
  guarded([this] {
    take_place(&service_.places.strangers);
    within(service_.limits.head_timeout_s, &HttpConnection::stop_reading);
    if (!transport_.has_tls()) return read_head();
    transport_.async_handshake([self = shared_from_this()](const Error& error) {
      self->guarded([&] { self->take_handshake(error); });
    });
  });
}

void HttpConnection::take_handshake(const Error& error) {
  if (!error) return read_head();
  const bool is_plain =
      error.category() == asio::error::get_ssl_category() &&
      ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_HTTP_REQUEST;
  if (!is_plain) return drop();
  ++service_.tally.refused;
  Error ignored;
  transport_.socket().non_blocking(true, ignored);
  transport_.socket().write_some(asio::buffer(kPlainHttp), ignored);
  linger_plainly();
}

void HttpConnection::read_head() {
  asio::async_read_until(
      transport_, asio::dynamic_buffer(received_, service_.limits.max_head_bytes), "\r\n\r\n",
      [self = shared_from_this()](const Error& error, std::size_t size) {
        self->guarded([&] { self->take_head(error, size); });
      });
}

void HttpConnection::take_head(const Error& error, std::size_t size) {
  without_deadline();
  if (error == asio::error::not_found) {
    ++service_.tally.refused;
    return answer(http_error(431, "the request's head is too large"));
  }
  if (error) {
    if (!late_ || received_.empty()) return drop();
    ++service_.tally.refused;
    return answer(http_error(408, "the request did not come in time"));
  }
  late_ = false;
  ++service_.tally.requests;
  ServerResponse refusal;
  if (!parse_http_head(std::string_view(received_).substr(0, size), &head_, &refusal))
    return answer(std::move(refusal));
  body_to_come_ = body_is_to_come(head_, received_.size() - size);
  route_ = service_.gate.admit(head_, monotonic_now_s(), body_to_come_, &client_, &refusal);
  if (client_.has_token) take_place(&service_.places.with_token);
  if (route_ == nullptr) return answer(std::move(refusal));
  std::size_t length = 0;
  if (head_.method == "POST" && !body_length(head_, route_->max_body, &length, &refusal)) {
    ServerResponse beyond;
    const bool charged =
        !body_to_come_ || service_.gate.charge(client_, monotonic_now_s(), &beyond);
    return answer(charged ? std::move(refusal) : std::move(beyond));
  }
  request_.method = head_.method;
  request_.path = head_.path;
  request_.parameters = std::move(head_.parameters);
  request_.body = received_.substr(size, length);
  body_came_ = request_.body.size();
  request_.body.resize(length);
  if (head_.expects_continue && body_came_ < length)
    return send(kContinue, &HttpConnection::read_body);
  read_body();
}

void HttpConnection::read_body() {
  if (body_came_ == request_.body.size()) return take_body(Error());
  within(service_.limits.body_timeout_s, &HttpConnection::stop_reading);
  asio::async_read(transport_,
                   asio::buffer(&request_.body[body_came_], request_.body.size() - body_came_),
                   [self = shared_from_this()](const Error& error, std::size_t) {
                     self->guarded([&] { self->take_body(error); });
                   });
}

void HttpConnection::take_body(const Error& error) {
  without_deadline();
  if (error) {
    return answer(http_error(400, late_ ? "the request's body did not come in time"
                                        : "the request's body is shorter than it said"));
  }
  complete_s_ = monotonic_now_s();
  ServerResponse refusal;
  if (body_to_come_ && !service_.gate.charge(client_, complete_s_, &refusal))
    return answer(std::move(refusal));
  ask_handler();
}

void HttpConnection::ask_handler() {
  without_deadline();
  service_.handlers.ask(shared_from_this());
}

void HttpConnection::work() noexcept {
  try {
    response_ = call(route_->handler, request_);
  } catch (...) {
    failed_ = true;
  }
}

void HttpConnection::take_answer() {
  guarded([this] {
    if (failed_) return drop();
    if (response_) return answer(std::move(*response_));
    request_.waited_s = monotonic_now_s() - complete_s_;
    within(kAskAgainS, &HttpConnection::ask_handler);
  });
}

void HttpConnection::answer(ServerResponse response) {
  const bool head_only = head_.method == "HEAD";
  if (response.stream && !head_only && !take_stream_place()) {
    ++service_.tally.refused;
    response = http_error(503, "too many streams");
  }
  std::string text = head_of(response);
  answer_deadline_s_ = monotonic_now_s() + kWholeAnswerS;
  if (response.stream && !head_only) {
    stream_ = std::move(response.stream);
    answer_deadline_s_ = std::numeric_limits<double>::infinity();
    return send(std::move(text), &HttpConnection::say_more);
  }
  if (!head_only) text += response.body;
  send(std::move(text), &HttpConnection::linger);
}

bool HttpConnection::take_stream_place() {
  FairPlaces<HttpConnection>& streams = service_.places.streams;
  if (streams.full()) {
    HttpConnection* const leaving = streams.one_too_many(client_.address);
    if (leaving == nullptr) return false;
    leaving->give_way();
  }
  take_place(&streams);
  ++service_.tally.streams;
  return true;
}

void HttpConnection::say_more() {
  std::string piece = std::move(sending_);
  piece.clear();
  try {
    stream_->next(&piece);
  } catch (const std::exception& e) {
    log_failure(e.what());
    return drop();
  }
  silent_ = piece.empty();
  if (silent_) return within(kSayAgainS, &HttpConnection::say_more);
  send(std::move(piece), &HttpConnection::say_more);
}

void HttpConnection::wake() {
  if (silent_) guarded([this] { say_more(); });
}

void HttpConnection::give_way() {
  ++service_.tally.refused;
  if (!spoke_) transport_.write_now(kTooMany);
  drop();
}

// Lets a client that is still sending read its answer. Closing at once would reset the connection.
void HttpConnection::linger() {
  if (!transport_.has_tls()) return linger_plainly();
  within(kLingerS, &HttpConnection::drop);
  transport_.async_end([self = shared_from_this()](const Error&) {
    self->guarded([&] { self->linger_plainly(); });
  });
}

// Discards what still comes, without TLS.
void HttpConnection::linger_plainly() {
  Error error;
  transport_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, error);
  if (error) return drop();
  within(kLingerS, &HttpConnection::drop);
  received_.resize(kLingerPiece);
  discard();
}

void HttpConnection::discard() {
  transport_.socket().async_read_some(
      asio::buffer(received_), [self = shared_from_this()](const Error& error, std::size_t count) {
        self->discarded_ += count;
        if (error || self->discarded_ >= kLingerBytes) return self->drop();
        self->guarded([&] { self->discard(); });
      });
}

void HttpConnection::send(std::string text, Step then) {
  sending_ = std::move(text);
  sent_ = 0;
  after_sending_ = then;
  spoke_ = true;
  send_rest();
}

void HttpConnection::send_rest() {
  within(std::min(service_.limits.write_timeout_s, answer_deadline_s_ - monotonic_now_s()),
         &HttpConnection::drop_stalled);
  transport_.async_write_some(asio::buffer(sending_) + sent_,
                              [self = shared_from_this()](const Error& error, std::size_t count) {
                                if (error) return self->drop();
                                self->guarded([&] { self->take_sent(count); });
                              });
}

void HttpConnection::take_sent(std::size_t count) {
  sent_ += count;
  if (sent_ < sending_.size()) return send_rest();
  without_deadline();
  (this->*after_sending_)();
}

void HttpConnection::take_place(FairPlaces<HttpConnection>* places) {
  if (places->full()) places->oldest_of_the_greediest()->give_way();
  leave_place();
  places->take(this, client_.address);
  place_ = places;
}

void HttpConnection::leave_place() {
  if (place_ == nullptr) return;
  place_->leave(this);
  if (place_ == &service_.places.streams) --service_.tally.streams;
  place_ = nullptr;
}

void HttpConnection::within(double time_s, Step late) {
  using Clock = asio::steady_timer::clock_type;
  timer_.expires_after(
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time_s)));
  timer_.async_wait([self = shared_from_this(), late](const Error& error) {
    // If the deadline was set anew while this call was under way, it has not expired.
    if (error || self->timer_.expiry() > Clock::now()) return;
    self->guarded([&] { ((*self).*late)(); });
  });
}

void HttpConnection::without_deadline() {
  timer_.expires_at(asio::steady_timer::time_point::max());
}

// Cancels the read repeatedly until it ends: a cancellation does not reach a read that pauses
// between two pieces. A read that the library lost never ends; then the connection is dropped.
void HttpConnection::stop_reading() {
  if (++cancelled_ > kCancelTimes) return drop();
  late_ = true;
  Error ignored;
  transport_.socket().cancel(ignored);
  within(kCancelAgainS, &HttpConnection::stop_reading);
}

void HttpConnection::drop_stalled() {
  ++service_.tally.stalled;
  drop();
}

// Ends all pending operations, and with them the last references that keep this object alive.
void HttpConnection::drop() {
  const auto keep = shared_from_this();
  ended_ = true;
  leave_place();
  service_.handlers.forget(this);
  without_deadline();
  Error ignored;
  transport_.socket().close(ignored);
}

}  // namespace alidade

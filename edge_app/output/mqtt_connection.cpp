#include "edge_app/output/mqtt_connection.h"

#include <fmt/format.h>
#include <mosquitto.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <system_error>

#include "platform/system/clock.h"
#include "platform/system/shown.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr double kMilli = 1000;

// Initializes the library once, for the life of the program.
bool library_is_ready() {
  static const bool ready = mosquitto_lib_init() == MOSQ_ERR_SUCCESS;
  return ready;
}

bool is_readable(const std::string& file) {
  std::string bytes;
  std::string ignored;
  return read_file(file, &bytes, &ignored) && !bytes.empty();
}

}  // namespace

// The library's object, and what it tells. Only calls of the connection lead to `owner`.
struct MqttConnection::Client {
  explicit Client(MqttConnection* of) : owner(of) {}
  ~Client() {
    if (handle != nullptr) mosquitto_destroy(handle);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  MqttConnection* owner;
  mosquitto* handle = nullptr;
  std::string last_complaint;  // last error of the library
  // Of the attempt to connect.
  int code = MOSQ_ERR_SUCCESS;
  int error_number = 0;
};

struct MqttConnection::Callbacks {
  static void connected(mosquitto* /*client*/, void* self, int answer) {
    MqttConnection* const connection = static_cast<Client*>(self)->owner;
    if (answer == 0) {
      connection->connected_ = true;
    } else {
      connection->fail_refused(answer);
    }
  }
  static void published(mosquitto* /*client*/, void* self, int id) {
    static_cast<Client*>(self)->owner->on_published_(id);
  }
  static void logged(mosquitto* /*client*/, void* self, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) static_cast<Client*>(self)->last_complaint = shown(text, 160);
  }
};

MqttConnection::MqttConnection(const MqttOptions& options, const Message* will, Errand* errand)
    : options_(options), errand_(*errand), client_(std::make_shared<Client>(this)) {
  if (library_is_ready())
    client_->handle = mosquitto_new(options.client_id.empty() ? nullptr : options.client_id.c_str(),
                                    true, client_.get());
  if (handle() == nullptr) return;
  mosquitto_connect_callback_set(handle(), &Callbacks::connected);
  mosquitto_publish_callback_set(handle(), &Callbacks::published);
  mosquitto_log_callback_set(handle(), &Callbacks::logged);
  if (will == nullptr) return;
  const int set =
      mosquitto_will_set(handle(), will->topic.c_str(), static_cast<int>(will->payload.size()),
                         will->payload.data(), options.qos, will->retain);
  if (set != MOSQ_ERR_SUCCESS) set_up_error_ = mosquitto_strerror(set);
}

mosquitto* MqttConnection::handle() const { return client_->handle; }

bool MqttConnection::fail_with(const std::string& what) {
  connected_ = false;
  if (error_.empty()) error_ = options_.name() + ": " + what;
  return false;
}

// Sets login and TLS.
bool MqttConnection::set_up() {
  if (handle() == nullptr) return fail_with("there is no memory for a connection");
  if (!set_up_error_.empty()) return fail_with(set_up_error_);
  if (!options_.user.empty() &&
      mosquitto_username_pw_set(handle(), options_.user.c_str(),
                                options_.password.empty() ? nullptr : options_.password.c_str()) !=
          MOSQ_ERR_SUCCESS)
    return fail_with("the user cannot be sent; use printable text for mqtt.user");
  if (!options_.tls) return true;
  const auto or_null = [](const std::string& text) {
    return text.empty() ? nullptr : text.c_str();
  };
  const int set = mosquitto_tls_set(
      handle(), or_null(options_.ca_file), options_.ca_file.empty() ? "/etc/ssl/certs" : nullptr,
      or_null(options_.certificate_file), or_null(options_.key_file), nullptr);
  if (set == MOSQ_ERR_SUCCESS) return true;
  return fail_with(fmt::format("TLS cannot be used: {}", mosquitto_strerror(set)));
}

std::string MqttConnection::files_error(const MqttOptions& options) {
  const std::pair<const char*, const std::string*> files[] = {
      {"ca_file", &options.ca_file},
      {"certificate_file", &options.certificate_file},
      {"key_file", &options.key_file}};
  for (const auto& [key, file] : files) {
    if (!file->empty() && !is_readable(*file))
      return fmt::format("mqtt.{}: {} cannot be read; name a file in PEM format", key, *file);
  }
  return "";
}

bool MqttConnection::begin() {
  if (!set_up()) return false;
  give_up_s_ = monotonic_now_s() + options_.timeout_s;
  beginning_ = errand_.begin([client = client_, host = options_.host, port = options_.port,
                              keep_alive_s = options_.keep_alive_s] {
    client->code = mosquitto_connect_async(client->handle, host.c_str(), port, keep_alive_s);
    client->error_number = errno;
  });
  return beginning_ || fail_with(kNameNotLookedUp);
}

// While the name is looked up. False: that failed.
bool MqttConnection::go_on_beginning() {
  if (!errand_.is_over()) return monotonic_now_s() < give_up_s_ || fail_with(kNameNotLookedUp);
  beginning_ = false;
  const int code = client_->code;
  if (code == MOSQ_ERR_SUCCESS || code == MOSQ_ERR_CONN_PENDING) return true;
  fail(client_->error_number, code);
  return false;
}

// error_number: errno of the call that returned this code.
void MqttConnection::fail(int error_number, int code) {
  const bool is_tls = code == MOSQ_ERR_TLS || code == MOSQ_ERR_TLS_HANDSHAKE;
  if (is_tls) {
    static_cast<void>(fail_with(fmt::format(
        "TLS failed{}; the broker's certificate must be for '{}' and of {}",
        client_->last_complaint.empty() ? "" : ": " + client_->last_complaint, options_.host,
        options_.ca_file.empty() ? "an authority of this system, or name mqtt.ca_file"
                                 : options_.ca_file)));
  } else if (code == MOSQ_ERR_EAI) {
    static_cast<void>(fail_with("the name cannot be looked up; is mqtt.url right?"));
  } else if (code == MOSQ_ERR_ERRNO) {
    static_cast<void>(fail_with(std::generic_category().message(error_number)));
  } else if (code == MOSQ_ERR_CONN_LOST && !connected_) {
    static_cast<void>(
        fail_with("no connection, or it was closed before an answer; is a broker there, and is TLS "
                  "right in mqtt.url (mqtts:// or mqtt://)?"));
  } else if (code == MOSQ_ERR_KEEPALIVE) {
    static_cast<void>(fail_with("the broker has fallen silent"));
  } else {
    static_cast<void>(fail_with(mosquitto_strerror(code)));
  }
}

void MqttConnection::fail_refused(int answer) {
  constexpr int kBadIdentifier = 2;
  constexpr int kBadLogin = 4;
  constexpr int kNotAuthorized = 5;
  if (answer == kBadLogin || answer == kNotAuthorized) {
    static_cast<void>(fail_with(
        options_.user.empty()
            ? "the broker wants a login; give mqtt.user with password_env or password_file"
            : fmt::format("the broker refuses the login of '{}'; check mqtt.user and its password",
                          shown(options_.user))));
  } else if (answer == kBadIdentifier) {
    static_cast<void>(fail_with("the broker refuses mqtt.client_id; choose another"));
  } else {
    static_cast<void>(
        fail_with(fmt::format("the broker refuses: {}", mosquitto_connack_string(answer))));
  }
}

// Asks the socket itself why there is no connection. During the TLS handshake the library takes
// such a failure for a need to wait.
bool MqttConnection::has_broken_off(bool* hung_up) {
  pollfd socket{this->socket(), POLLIN, 0};
  *hung_up = ::poll(&socket, 1, 0) == 1 && (socket.revents & (POLLERR | POLLHUP)) != 0;
  if (!*hung_up) return false;
  int error_number = 0;
  socklen_t size = sizeof error_number;
  static_cast<void>(::getsockopt(socket.fd, SOL_SOCKET, SO_ERROR, &error_number, &size));
  // Before a reset the broker may have sent an answer, which says more.
  if (error_number == 0 || error_number == ECONNRESET) return false;
  fail(error_number, MOSQ_ERR_ERRNO);
  return true;
}

// Whether this result of the library ends the connection. Then the error is set.
bool MqttConnection::has_failed(int code) {
  if (code == MOSQ_ERR_SUCCESS && mosquitto_socket(handle()) >= 0) return false;
  if (ending_) return true;
  fail(errno, code == MOSQ_ERR_SUCCESS ? MOSQ_ERR_CONN_LOST : code);
  return true;
}

// Checks the length of a packet before the library reads it. The library would allocate as much as
// the broker states, up to 256 MB. A publisher only gets answers of two or four bytes.
MqttConnection::Incoming MqttConnection::look_at_what_comes() const {
  std::array<std::uint8_t, 4> bytes{};
  int count = 0;
  if (options_.tls) {
    auto* const tls = static_cast<SSL*>(mosquitto_ssl_get(handle()));
    if (tls == nullptr || SSL_is_init_finished(tls) == 0) return Incoming::kUnknown;
    count = SSL_peek(tls, bytes.data(), static_cast<int>(bytes.size()));
    if (count <= 0) return Incoming::kUnknown;
  } else {
    count = static_cast<int>(
        ::recv(socket(), bytes.data(), bytes.size(), MSG_PEEK | MSG_DONTWAIT | MSG_NOSIGNAL));
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return Incoming::kNothing;
    if (count <= 0) return Incoming::kUnknown;
  }
  constexpr std::array<std::uint8_t, 5> kAnswers = {0x20, 0x40, 0x50, 0x70, 0xD0};
  constexpr std::uint8_t kAnswerToPing = 0xD0;
  const int length = bytes[0] == kAnswerToPing ? 0 : 2;
  if (std::find(kAnswers.begin(), kAnswers.end(), bytes[0]) == kAnswers.end() ||
      (count > 1 && bytes[1] != length)) {
    return Incoming::kForeign;
  }
  return count < 2 + length ? Incoming::kHalfAnswer : Incoming::kAnswer;
}

bool MqttConnection::read_answers() {
  constexpr int kMost = 16;        // answers in one step, so that other work has its turn
  constexpr int kMostPackets = 1;  // the value that the library's manual asks for
  constexpr double kHalf_s = 1;
  for (int i = 0; i < kMost; ++i) {
    const Incoming incoming = look_at_what_comes();
    if (incoming == Incoming::kForeign) {
      return fail_with(
          "the answer is not one that a broker gives to a publisher; is a broker there, and is TLS "
          "right in mqtt.url (mqtts:// or mqtt://)?");
    }
    if (incoming == Incoming::kHalfAnswer) {
      const double now_s = monotonic_now_s();
      if (half_since_s_ < 0) half_since_s_ = now_s;
      if (now_s - half_since_s_ < kHalf_s) return true;
      return fail_with("only half of an answer has come");
    }
    half_since_s_ = -1;
    if (incoming == Incoming::kNothing) return true;
    if (has_failed(mosquitto_loop_read(handle(), kMostPackets)) || !error_.empty()) return false;
    if (incoming == Incoming::kUnknown) return true;
  }
  return true;
}

bool MqttConnection::step() {
  if (beginning_ && !go_on_beginning()) return false;
  if (beginning_) return true;
  bool hung_up = false;
  if (!connected_ && has_broken_off(&hung_up)) return false;
  if (!read_answers()) return false;
  if (mosquitto_want_write(handle()) && has_failed(mosquitto_loop_write(handle(), 1))) return false;
  if (has_failed(mosquitto_loop_misc(handle())) || !error_.empty()) return false;
  if (connected_) return true;
  if (hung_up) {
    fail(0, MOSQ_ERR_CONN_LOST);
    return false;
  }
  if (monotonic_now_s() > give_up_s_)
    return fail_with(fmt::format("no answer within {:g} s", options_.timeout_s));
  return true;
}

int MqttConnection::socket() const {
  if (beginning_) return errand_.descriptor();
  return handle() == nullptr ? -1 : mosquitto_socket(handle());
}

bool MqttConnection::wants_to_write() const {
  return !beginning_ && (connected_ || !options_.tls) && mosquitto_want_write(handle());
}

double MqttConnection::patience_s() const {
  constexpr double kKeepAlive_s = 1;
  constexpr double kAnswer_s = 0.1;
  constexpr double kTls_s = 0.02;
  constexpr double kOtherHalf_s = 0.02;
  if (!wants_to_read()) return kOtherHalf_s;
  if (connected_) return kKeepAlive_s;
  return options_.tls ? kTls_s : kAnswer_s;
}

bool MqttConnection::publish(const std::string& topic, const std::string& payload, bool retain,
                             int* id) {
  const int code = mosquitto_publish(handle(), id, topic.c_str(), static_cast<int>(payload.size()),
                                     payload.data(), options_.qos, retain);
  if (code == MOSQ_ERR_SUCCESS) return true;
  fail(errno, code);
  return false;
}

void MqttConnection::end() {
  ending_ = true;
  static_cast<void>(mosquitto_disconnect(handle()));
}

std::string MqttConnection::try_once(const MqttOptions& options) {
  MqttOptions of_a_stranger = options;
  // A second client with the same id would disconnect a running program.
  of_a_stranger.client_id.clear();
  Errand errand;
  MqttConnection connection(of_a_stranger, nullptr, &errand);
  if (!connection.begin()) return connection.error();
  while (!connection.is_connected()) {
    pollfd socket{connection.socket(), 0, 0};
    if (connection.wants_to_read()) socket.events |= POLLIN;
    if (connection.wants_to_write()) socket.events |= POLLOUT;
    static_cast<void>(::poll(&socket, 1, static_cast<int>(kMilli * connection.patience_s())));
    if (!connection.step()) return connection.error();
  }
  connection.end();
  return "";
}

}  // namespace alidade

#include "test/simulator/servers/vapix_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <limits>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "test/simulator/servers/digest_auth.h"

namespace alidade {
namespace {

constexpr const char* kPlainText = "text/plain";

double monotonic_now_s() {
  // libstdc++'s steady clock is CLOCK_MONOTONIC.
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string position_text(const VapixPosition& position) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "pan=%.4f\r\ntilt=%.4f\r\nzoom=%.0f\r\niris=5000\r\nfocus=5000\r\n"
                "autofocus=on\r\nautoiris=on\r\n",
                position.pan_deg, position.tilt_deg, position.zoom);
  return text.data();
}

constexpr const char* kLimits =
    "MinPan=-180\r\nMaxPan=180\r\nMinTilt=-90\r\nMaxTilt=90\r\nMinZoom=1\r\nMaxZoom=9999\r\n"
    "MinIris=1\r\nMaxIris=9999\r\nMinFocus=1\r\nMaxFocus=9999\r\n";

constexpr const char* kPage = "<html><body><h1>Welcome</h1></body></html>\r\n";

}  // namespace

struct VapixServer::Impl {
  Impl(VapixServerOptions given, PositionAt callback)
      : options(std::move(given)),
        position_at(std::move(callback)),
        behaviour(options.behaviour),
        random(options.seed) {
    if (!options.user.empty()) auth.emplace(options.user, options.password, "AXIS_ALIDADE");
  }

  const VapixServerOptions options;
  const PositionAt position_at;
  std::mutex position_mutex;
  std::optional<DigestAuth> auth;

  std::unique_ptr<httplib::Server> http;
  std::thread listener;
  std::atomic<int> port{0};
  std::atomic<std::int64_t> requests{0};
  std::atomic<std::int64_t> unauthorized{0};

  std::mutex mutex;  // guards what follows
  std::condition_variable changed;
  VapixBehaviour behaviour;
  std::uint64_t behaviour_version = 0;
  bool stopping = false;
  std::mt19937_64 random;

  httplib::Server::HandlerResponse authorize(const httplib::Request& request,
                                             httplib::Response& response) {
    ++requests;
    if (!auth) return httplib::Server::HandlerResponse::Unhandled;
    const DigestStatus status =
        auth->check(request.method, request.target, request.get_header_value("Authorization"));
    if (status == DigestStatus::kOk) return httplib::Server::HandlerResponse::Unhandled;
    ++unauthorized;
    response.status = 401;
    response.set_header("WWW-Authenticate", auth->challenge(status));
    response.set_content("Unauthorized\r\n", kPlainText);
    return httplib::Server::HandlerResponse::Handled;
  }

  void answer(const httplib::Request& request, httplib::Response& response) {
    VapixBehaviour now;
    double before_s = 0;
    double after_s = 0;
    {
      std::unique_lock<std::mutex> lock(mutex);
      now = behaviour;
      if (now.fault == VapixFault::kSilence) {
        const std::uint64_t version = behaviour_version;
        changed.wait(lock, [&] { return stopping || behaviour_version != version; });
        return drop(response);
      }
      double delay_s = now.delay_s;
      if (now.random_delay_s > 0) {
        delay_s += std::exponential_distribution<double>(1 / now.random_delay_s)(random);
      }
      before_s = std::uniform_real_distribution<double>(0, 1)(random) * delay_s;
      after_s = delay_s - before_s;
    }
    wait(before_s);
    VapixPosition position;
    {
      const std::lock_guard<std::mutex> lock(position_mutex);
      position = position_at(monotonic_now_s());
    }
    wait(after_s);
    switch (now.fault) {
      case VapixFault::kServerError:
        response.status = 500;
        return response.set_content("Internal Server Error\r\n", kPlainText);
      case VapixFault::kErrorBody:
        return response.set_content("Error:\r\nptz device not ready\r\n", kPlainText);
      case VapixFault::kWrongContent:
        return response.set_content(kPage, "text/html");
      case VapixFault::kDropConnection:
        return drop(response);
      case VapixFault::kNone:
      case VapixFault::kSilence:
        break;
    }
    const std::string query = request.get_param_value("query");
    const std::string camera = request.get_param_value("camera");
    if (!camera.empty() && camera != "1") {
      response.set_content("Error:\r\nno such camera: " + camera + "\r\n", kPlainText);
    } else if (query == "position") {
      response.set_content(position_text(position), kPlainText);
    } else if (query == "limits") {
      response.set_content(kLimits, kPlainText);
    } else {
      response.set_content("Error:\r\nunknown query: " + query + "\r\n", kPlainText);
    }
  }

  // Announces a body and closes the connection instead of sending it.
  static void drop(httplib::Response& response) {
    response.set_content_provider(
        64, kPlainText, [](std::size_t, std::size_t, httplib::DataSink&) { return false; });
  }

  void wait(double duration_s) {
    if (duration_s <= 0) return;
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait_for(lock, std::chrono::duration<double>(duration_s), [this] { return stopping; });
  }
};

VapixServer::VapixServer(VapixServerOptions options, PositionAt position_at)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(position_at))) {}

VapixServer::~VapixServer() { stop(); }

bool VapixServer::start(std::string* error) {
  Impl& impl = *impl_;
  if (impl.http) {
    *error = "VAPIX server: already started";
    return false;
  }
  impl.stopping = false;
  auto http = std::make_unique<httplib::Server>();
  // The library's default, SO_REUSEPORT, would let two servers share a port unnoticed.
  http->set_socket_options([](socket_t socket) {
    const int on = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  });
  // The library writes header and body separately: without this the body could wait for the ACK.
  http->set_tcp_nodelay(true);
  http->set_keep_alive_max_count(std::numeric_limits<int>::max());
  http->set_keep_alive_timeout(kIdleTimeoutS);
  http->set_pre_routing_handler(
      [&impl](const auto& request, auto& response) { return impl.authorize(request, response); });
  http->Get("/axis-cgi/com/ptz.cgi",
            [&impl](const auto& request, auto& response) { impl.answer(request, response); });

  const int wanted = impl.options.port;
  const int bound = wanted == 0 ? http->bind_to_any_port(impl.options.address)
                    : http->bind_to_port(impl.options.address, wanted) ? wanted
                                                                       : -1;
  if (bound < 0) {
    *error = "VAPIX server: cannot listen on " + impl.options.address + ":" +
             std::to_string(wanted) + " (is the port in use?)";
    return false;
  }
  impl.port = bound;
  impl.http = std::move(http);
  impl.listener = std::thread([server = impl.http.get()] { server->listen_after_bind(); });
  // The library ignores a stop() that comes before its thread listens.
  while (!impl.http->is_running()) std::this_thread::yield();
  return true;
}

void VapixServer::stop() {
  Impl& impl = *impl_;
  if (!impl.http) return;
  {
    const std::lock_guard<std::mutex> lock(impl.mutex);
    impl.stopping = true;
  }
  impl.changed.notify_all();
  impl.http->stop();
  impl.listener.join();
  impl.http.reset();
}

int VapixServer::port() const { return impl_->port; }

void VapixServer::set_behaviour(const VapixBehaviour& behaviour) {
  {
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    impl_->behaviour = behaviour;
    ++impl_->behaviour_version;
  }
  impl_->changed.notify_all();
}

std::int64_t VapixServer::requests() const { return impl_->requests; }
std::int64_t VapixServer::unauthorized() const { return impl_->unauthorized; }

}  // namespace alidade

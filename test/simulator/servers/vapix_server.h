#pragma once
// The virtual camera's pan/tilt side: an HTTP server that answers Axis VAPIX position queries,
//   GET /axis-cgi/com/ptz.cgi?query=position[&camera=1]  ->  pan=..\r\ntilt=..\r\nzoom=..\r\n...
//   GET /axis-cgi/com/ptz.cgi?query=limits
// as text/plain, in degrees with four decimals (zoom a whole number), and, like an Axis, reports an
// unknown query by a body "Error:..." under status 200. Digest authentication when user is set.
//
// The position is asked for at a uniformly random moment of the answer's delay, so a client may
// only conclude that it was true somewhere between sending the request and receiving the first
// byte. Connections are kept alive for kIdleTimeoutS between requests; stop() may wait that long
// for a client that keeps one open and is silent. Threads: start() and stop() from one thread;
// everything else from any. The position callback runs on the server's threads, never twice at
// once. Allocates per request.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace alidade {

struct VapixPosition {
  double pan_deg = 0;
  double tilt_deg = 0;
  double zoom = 1;
};

enum class VapixFault {
  kNone,
  kServerError,     // status 500
  kErrorBody,       // status 200 and a body "Error:..."
  kWrongContent,    // status 200 and a page of HTML
  kSilence,         // takes the request and never answers
  kDropConnection,  // closes the connection in mid-answer
};

struct VapixBehaviour {
  VapixFault fault = VapixFault::kNone;
  double delay_s = 0;         // every answer is at least this late
  double random_delay_s = 0;  // mean of an exponential delay on top
};

struct VapixServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;      // 0 = any free one
  std::string user;  // empty = no authentication
  std::string password;
  VapixBehaviour behaviour;
  std::uint64_t seed = 1;  // of the random delays
};

class VapixServer {
 public:
  using PositionAt = std::function<VapixPosition(double monotonic_s)>;
  static constexpr int kIdleTimeoutS = 1;

  VapixServer(VapixServerOptions options, PositionAt position_at);
  ~VapixServer();
  VapixServer(const VapixServer&) = delete;
  VapixServer& operator=(const VapixServer&) = delete;

  // On failure says why in *error. May be called again after stop().
  [[nodiscard]] bool start(std::string* error);
  void stop();

  // The port listened on; 0 before start().
  [[nodiscard]] int port() const;

  // Takes effect with the next request; ends the silence of requests that wait.
  void set_behaviour(const VapixBehaviour& behaviour);

  [[nodiscard]] std::int64_t requests() const;      // all, the refused ones too
  [[nodiscard]] std::int64_t unauthorized() const;  // answered with status 401

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade

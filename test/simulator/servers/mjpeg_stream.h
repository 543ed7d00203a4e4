#pragma once
// MjpegStream: the virtual camera's pictures over HTTP, GET /mjpg/video.mjpg: multipart/x-mixed-replace
// with Content-Length and X-Timestamp (the sender's clock), the newest picture to each client as fast as
// it takes them. Digest authentication when user is set.
//
// Threads: push() from one, the server's own. Allocates.

#include <httplib.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "test/simulator/servers/digest_auth.h"

namespace alidade {

struct MjpegStreamOptions {
  int port = 0;      // 0 = any free one
  std::string user;  // empty = no authentication
  std::string password;
};

class MjpegStream {
 public:
  explicit MjpegStream(MjpegStreamOptions options);
  ~MjpegStream() { stop(); }
  MjpegStream(const MjpegStream&) = delete;
  MjpegStream& operator=(const MjpegStream&) = delete;

  // On failure says why in *error.
  [[nodiscard]] bool start(std::string* error);
  void stop();
  [[nodiscard]] int port() const { return port_; }

  void push(const std::uint8_t* jpeg, std::size_t size, double sender_s);

 private:
  void serve(const httplib::Request& request, httplib::Response& response);

  const MjpegStreamOptions options_;
  std::optional<DigestAuth> auth_;
  httplib::Server http_;
  std::thread listener_;
  int port_ = 0;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::shared_ptr<const std::string> part_;  // the newest picture with its header
  std::int64_t count_ = 0;
  bool stopping_ = false;
};

}  // namespace alidade

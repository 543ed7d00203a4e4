#pragma once
// MjpegServer: the MJPEG side of a camera on the loopback. Sends numbered pictures, picture n of the one
// grey grey_of(n), to one client after another, in the words that `style` says: cameras differ.
//
// The numbers go on over connections. Stamps of the sending are kept, to hold the receiver's against.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "test/platform/support/raw_server.h"
#include "test/simulator/servers/digest_check.h"

namespace alidade {

struct MjpegStyle {
  std::string status = "200 OK";
  std::string type = "multipart/x-mixed-replace; boundary=--myboundary";
  std::string before = "--myboundary\r\n";               // each part
  std::string headers = "Content-Type: image/jpeg\r\n";  // of each part, besides those below
  bool length = true;                                    // Content-Length
  std::optional<double> timestamp_step_s;                // X-Timestamp grows so; none without
  bool timestamps_run = false;  // X-Timestamp is the time of sending, instead
  std::string after = "\r\n";   // each part
  bool pause_in_part = false;   // waits between the first byte of a part and the rest
};

class MjpegServer {
 public:
  static constexpr int kWidth = 96;
  static constexpr int kHeight = 64;
  static int grey_of(std::int64_t n) { return 40 + static_cast<int>(n * 7 % 160); }
  static std::string picture(std::int64_t n);

  enum class Login { kNone, kBasic, kDigestMd5, kDigestSha256 };

  explicit MjpegServer(MjpegStyle style = {}, Login login = Login::kNone);

  int port() const { return server_.port(); }
  std::string url() const {
    return "http://127.0.0.1:" + std::to_string(port()) + "/video.cgi?x=y";
  }
  static constexpr const char* kUser = "us er";
  static constexpr const char* kPassword = "secret:\"x";

  void renew_nonce() { check_.renew_nonce(); }  // as if it had restarted

  // Host times just before the first byte of picture n was handed to the socket and, with
  // pause_in_part, the others.
  struct Sent {
    double before_first_s = 0;
    double before_rest_s = 0;
  };
  Sent sent(std::int64_t n) const;

  std::atomic<int> refusals{0};                // answers 401
  std::atomic<std::int64_t> allowed{1 << 30};  // pictures before it pauses
  std::atomic<bool> refuse{false};             // whatever the login
  std::atomic<bool> hang_up{false};            // ends the connection before the next picture

 private:
  void serve(int fd);
  bool let_in(int fd);
  bool send_picture(int fd);

  MjpegStyle style_;
  Login login_;
  DigestCheck check_;
  mutable std::mutex mutex_;
  std::vector<Sent> sent_;  // guarded by mutex_
  std::int64_t next_ = 0;
  RawServer server_{[this](int fd) { serve(fd); }};  // last: its thread uses the others
};

}  // namespace alidade

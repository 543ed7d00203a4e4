#pragma once
// ScriptedRtspServer: the RTSP side of a camera on the loopback that sends MJPEG by TCP or UDP, and
// answers as the test says where cameras differ from the real server (rtsp_server.h): refuses, asks,
// redirects, boots. Its pictures tell their number by their grey (rtp_sender.h).

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "test/platform/support/raw_server.h"
#include "test/platform/support/rtp_relay.h"
#include "test/platform/support/rtp_sender.h"

namespace alidade {

struct RtspRequest {
  int connection = 0;  // 1, 2, ...
  std::string method;  // or RTSP/1.0: an answer to what the camera asked
  std::string text;    // line and headers
};

struct RtspAnswer {
  std::string status = "200 OK";
  std::string headers;           // whole lines
  std::string body;              // of DESCRIBE
  std::string before;            // bytes that are sent before the answer
  bool pictures_before = false;  // two of them, too (TCP)
};

class ScriptedRtspServer {
 public:
  // Changes what a plain camera answers to the request.
  using Script = std::function<void(const RtspRequest&, RtspAnswer*)>;

  explicit ScriptedRtspServer(Script script = [](const RtspRequest&, RtspAnswer*) {})
      : script_(std::move(script)) {}

  std::string url() const {
    return "rtsp://127.0.0.1:" + std::to_string(server_.port()) + "/video";
  }

  // How many requests of this method have come, with this text in them.
  int count(const std::string& method, const std::string& text = "") const;

  std::atomic<bool> hang_up{false};  // once, at the next picture
  std::atomic<bool> stop_speaking{
      false};                    // closes its side of the RTSP connection, sends on by UDP
  std::atomic<bool> ask{false};  // once, OPTIONS with CSeq 77, at the next picture

  // Changes the packets of each picture; after that, within the connection, what is sent for each of them. Set before
  // anybody connects.
  std::function<void(std::int64_t picture, RtpRelay::Packets*)> change_packets;
  std::function<void(std::int64_t packet, std::string*)> change_bytes;

 private:
  struct Stream;
  void serve(int fd);
  bool answer(int fd, const RtspRequest& request, Stream* stream);
  bool send_picture(int fd, Stream* stream) const;

  Script script_;
  mutable std::mutex mutex_;
  std::vector<RtspRequest> requests_;                // guarded by mutex_
  RawServer server_{[this](int fd) { serve(fd); }};  // last: its thread uses the others
};

}  // namespace alidade

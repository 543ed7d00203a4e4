#pragma once
// Where RTP packets come from: UDP ports, by themselves here, or with an RTSP session
// (rtsp_session.h). Part of RtpConnection, which takes the packets apart.
//
// open() and receive() block until deadline_s (CLOCK_MONOTONIC) at most; after interrupt(), which any
// thread may call, they return at once, for good.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "platform/video/av_handles.h"
#include "platform/video/frame_source.h"

namespace alidade {

class RtpTransport {
 public:
  virtual ~RtpTransport() = default;

  // kOk: *sdp describes what will come. Else *error is one line without URL and password.
  [[nodiscard]] virtual ReadStatus open(double deadline_s, std::string* sdp,
                                        std::string* error) = 0;

  // The next packet, RTP or RTCP. kTimeout: none until the deadline. Else as open().
  [[nodiscard]] virtual ReadStatus receive(double deadline_s, std::uint8_t* data,
                                           std::size_t capacity, std::size_t* size,
                                           std::string* error) = 0;

  virtual void interrupt() = 0;
};

// A pair of UDP ports, for RTP and RTCP (libavformat's protocol "rtp").
class RtpPorts {
 public:
  // address: the group to join, or of the sender.
  [[nodiscard]] ReadStatus open(const std::string& address, int port, std::string* error);
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   std::size_t* size, std::string* error);
  void interrupt() { interrupted_ = true; }  // thread-safe

 private:
  static int is_over(void* self);

  std::atomic<bool> interrupted_{false};
  double deadline_s_ = 0;
  AvioPtr io_;
};

// What a session description or an rtp:// URL says.
class UdpTransport : public RtpTransport {
 public:
  explicit UdpTransport(std::string sdp) : sdp_(std::move(sdp)) {}
  [[nodiscard]] ReadStatus open(double deadline_s, std::string* sdp, std::string* error) override;
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   std::size_t* size, std::string* error) override {
    return ports_.receive(deadline_s, data, capacity, size, error);
  }
  void interrupt() override { ports_.interrupt(); }

 private:
  std::string sdp_;
  RtpPorts ports_;
};

}  // namespace alidade

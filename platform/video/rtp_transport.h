#pragma once
// Where RTP packets come from: UDP ports, by themselves here, or with an RTSP session
// (rtsp_session.h). Part of RtpConnection, which takes the packets apart.
//
// open() and receive() block until deadline_s (CLOCK_MONOTONIC) at most; after interrupt(), which any
// thread may call, they return within 0.1 s, for good.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "platform/system/file_descriptor.h"
#include "platform/video/frame_source.h"
#include "platform/video/udp_senders.h"

namespace alidade {

// An RTP or RTCP packet that came.
struct ReceivedPacket {
  std::size_t size = 0;  // bytes
  double arrival_s =
      0;  // CLOCK_MONOTONIC: as the kernel has it where it says, else when it was read
};

class RtpTransport {
 public:
  virtual ~RtpTransport() = default;

  // kOk: *sdp describes what will come. Else *error is one line without URL and password.
  [[nodiscard]] virtual ReadStatus open(double deadline_s, std::string* sdp,
                                        std::string* error) = 0;

  // The next packet, RTP or RTCP. kTimeout: none until the deadline. Else as open().
  [[nodiscard]] virtual ReadStatus receive(double deadline_s, std::uint8_t* data,
                                           std::size_t capacity, ReceivedPacket* packet,
                                           std::string* error) = 0;

  virtual void interrupt() = 0;

  // Of the open transport: the SSRC of the packets that will come, if the sender told it.
  [[nodiscard]] virtual std::optional<std::uint32_t> agreed_source() const { return std::nullopt; }
  // Packets of somebody else than the sender, left out, and whose in a person's words.
  [[nodiscard]] virtual std::int64_t foreign() const { return 0; }
  [[nodiscard]] virtual std::string foreign_kind() const { return ""; }
  // Bytes passed over because they belong to no packet.
  [[nodiscard]] virtual std::int64_t garbage() const { return 0; }
};

// A pair of UDP ports, for RTP and RTCP.
//
// Packets have the time at which the kernel took them from the network: what happens until this process reads them (others
// compute, it was stopped) is no part of it. So the packets amid a picture can be left to gather for kGather_s before they
// are waited for: a wake-up for each costs a third of what a picture costs from packet to record.
class RtpPorts {
 public:
  static constexpr double kGather_s = 150e-6;

  // address: the group to join, or of the sender. senders: whose packets are taken, on both ports.
  [[nodiscard]] ReadStatus open(const std::string& address, int port, const UdpSenders& senders,
                                std::string* error);
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error);
  void interrupt() { interrupted_ = true; }  // thread-safe
  // One more sender, whom the first has named. What is no numeric address is left out.
  void also_from(const std::string& address) { (void)senders_.add(address); }
  [[nodiscard]] const UdpSenders& senders() const { return senders_; }

 private:
  struct Socket {
    FileDescriptor descriptor;
    double not_before_s = 0;  // what waits has come since
  };
  ReadStatus take(Socket* socket, std::uint8_t* data, std::size_t capacity, ReceivedPacket* packet,
                  std::string* error);

  std::atomic<bool> interrupted_{false};
  UdpSenders senders_;
  std::array<Socket, 2> sockets_;  // RTP, RTCP
  bool amid_picture_ = false;      // after the last RTP packet
};

// What a session description or an rtp:// URL says.
class UdpTransport : public RtpTransport {
 public:
  explicit UdpTransport(std::string sdp) : sdp_(std::move(sdp)) {}
  [[nodiscard]] ReadStatus open(double deadline_s, std::string* sdp, std::string* error) override;
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error) override {
    return ports_.receive(deadline_s, data, capacity, packet, error);
  }
  void interrupt() override { ports_.interrupt(); }
  [[nodiscard]] std::int64_t foreign() const override { return ports_.senders().foreign(); }
  [[nodiscard]] std::string foreign_kind() const override {
    return ports_.senders().foreign_kind();
  }

 private:
  std::string sdp_;
  RtpPorts ports_;
};

}  // namespace alidade

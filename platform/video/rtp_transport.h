#pragma once
// Sources of RTP packets: UDP ports (here), alone or with an RTSP session (rtsp_session.h). Part of
// RtpConnection, which unpacks the packets. open() and receive() block until deadline_s (s,
// CLOCK_MONOTONIC) at most. After interrupt(), which any thread may call, these and all later calls
// return within 0.1 s.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "platform/system/file_descriptor.h"
#include "platform/video/frame_source.h"
#include "platform/video/sender_choice.h"
#include "platform/video/udp_senders.h"

namespace alidade {

// A received RTP or RTCP packet.
struct ReceivedPacket {
  std::size_t size = 0;  // bytes
  // s, CLOCK_MONOTONIC; the kernel's time if it gives one, else when the packet was read.
  double arrival_s = 0;
};

class RtpTransport {
 public:
  virtual ~RtpTransport() = default;

  // kOk: *sdp describes the stream. Otherwise *error is one line without URL and password.
  [[nodiscard]] virtual ReadStatus open(double deadline_s, std::string* sdp,
                                        std::string* error) = 0;

  // The next RTP or RTCP packet. kTimeout: none until the deadline. Other results as of open().
  [[nodiscard]] virtual ReadStatus receive(double deadline_s, std::uint8_t* data,
                                           std::size_t capacity, ReceivedPacket* packet,
                                           std::string* error) = 0;

  virtual void interrupt() = 0;

  // SSRC of the packets to come on the open transport, if the sender announced it.
  [[nodiscard]] virtual std::optional<std::uint32_t> agreed_source() const { return std::nullopt; }
  // Number of packets from others than the sender, which are left out, and a description of these
  // others.
  [[nodiscard]] virtual std::int64_t foreign() const { return 0; }
  [[nodiscard]] virtual std::string foreign_kind() const { return ""; }
  // Number of skipped bytes that belong to no packet.
  [[nodiscard]] virtual std::int64_t garbage() const { return 0; }
};

// A pair of UDP ports, for RTP and RTCP. Packets have the time at which the kernel received them,
// so delays until this process reads them (load, a stopped process) do not matter. Therefore
// packets within a picture may gather for kGather_s before the next wait: waking up for each would
// cost a third of the time of a picture from packet to record.
class RtpPorts {
 public:
  static constexpr double kGather_s = 150e-6;

  // address: the multicast group, or the sender's address. senders: whose packets are accepted, on
  // both ports. choice: decides among these packets, and must outlive the ports; null: all are
  // taken.
  [[nodiscard]] ReadStatus open(const std::string& address, int port, const UdpSenders& senders,
                                std::string* error, SenderChoice* choice = nullptr);
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error);
  void interrupt() { interrupted_ = true; }  // thread-safe
  // Accepts one more sender, named by the first. Ignored if it is not a numeric address.
  void also_from(const std::string& address) { (void)senders_.add(address); }
  [[nodiscard]] const UdpSenders& senders() const { return senders_; }

 private:
  struct Socket {
    FileDescriptor descriptor;
    double not_before_s = 0;  // a packet that is waiting came after this time
  };
  ReadStatus take(Socket* socket, std::uint8_t* data, std::size_t capacity, ReceivedPacket* packet,
                  std::string* error);

  std::atomic<bool> interrupted_{false};
  UdpSenders senders_;
  SenderChoice* choice_ = nullptr;
  std::array<Socket, 2> sockets_;  // RTP, RTCP
  bool amid_picture_ = false;      // the last RTP packet was not the end of a picture
};

// Plain RTP, from a session description or an rtp:// URL. Packets of others than the senders and
// the SSRC that the description names are left out; without a sender's address, `choice` decides.
class UdpTransport : public RtpTransport {
 public:
  UdpTransport(std::string sdp, SenderChoice* choice) : sdp_(std::move(sdp)), choice_(*choice) {}
  [[nodiscard]] ReadStatus open(double deadline_s, std::string* sdp, std::string* error) override;
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error) override;
  void interrupt() override { ports_.interrupt(); }
  [[nodiscard]] std::int64_t foreign() const override {
    return ports_.senders().foreign() + choice_.foreign();
  }
  [[nodiscard]] std::string foreign_kind() const override {
    return choice_.foreign() > 0 ? choice_.foreign_kind() : ports_.senders().foreign_kind();
  }

 private:
  std::string sdp_;
  SenderChoice& choice_;
  RtpPorts ports_;
};

}  // namespace alidade

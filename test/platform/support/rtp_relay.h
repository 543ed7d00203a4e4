#pragma once
// RtpRelay: stands between an RtpSender and a receiver on the loopback, and does to its packets what
// networks and cameras do: leaves out, exchanges, repeats, adds the extension 0xABAC, and reports of its
// own. Without a thread: forward() passes on what has come.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace alidade {

class RtpRelay {
 public:
  using Packet = std::vector<std::uint8_t>;
  using Packets = std::vector<Packet>;

  explicit RtpRelay(int to_port);
  ~RtpRelay();
  RtpRelay(const RtpRelay&) = delete;
  RtpRelay& operator=(const RtpRelay&) = delete;

  int port() const { return port_; }  // for the sender

  // The first packet that is forwarded gets this timestamp, and those after it by as much another one:
  // the sender begins at a random one.
  void begin_at(std::uint32_t timestamp) { first_ = timestamp; }

  // What has come since (RTP only), changed by `change`.
  void forward(const std::function<void(Packets&)>& change = [](Packets&) {});

  // Sends an RTCP sender report of these times: 64 bits of NTP, the timestamp that RTP has then.
  void report(std::uint64_t ntp, std::uint32_t timestamp);

 private:
  int fd_;
  int rtcp_fd_;
  int port_;
  int to_port_;
  std::optional<std::uint32_t> first_;
  std::optional<std::uint32_t> shift_;
};

// The packet with the extension of the time (Unix seconds; multiples of 1/16 are exact).
RtpRelay::Packet with_capture_time(const RtpRelay::Packet& packet, double utc_s);

}  // namespace alidade

#pragma once
// SenderChoice: whose packets of plain RTP are the video, if the description names no sender's
// address: anyone can send to an open port or to a group.
//
//   on trial  one sender (address and SSRC) is followed, at first the one whose packet comes first.
//             After timeout_s without a decodable picture (doubled at each further trial of the
//             same sender, at most to 64 timeout_s), if others were heard within timeout_s, the
//             connection ends; the next one tries the least tried of those heard.
//   kept      once a picture is decoded, for this connection, and for the next one unless its
//             address was silent for timeout_s before. A new SSRC there is StreamFilter's matter.
//
// Packets of others are foreign. At most kMostKnown senders are remembered at a time; further ones
// are foreign and not tried. Outlives connections. Thread-safe.

#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "platform/video/udp_senders.h"

namespace alidade {

class SenderChoice {
 public:
  static constexpr std::size_t kMostKnown = 16;

  explicit SenderChoice(double timeout_s) : timeout_s_(timeout_s) {}

  // To be called at the start of a connection. payload_type < 0: any. source: the SSRC that the
  // description names; others are foreign. by_address: no address is named, so this class chooses
  // one. now_s: s, CLOCK_MONOTONIC.
  void begin(int payload_type, std::optional<std::uint32_t> source, bool by_address, double now_s);
  // True if this packet, RTP or RTCP, is to be taken.
  [[nodiscard]] bool take(const sockaddr_storage& from, const std::uint8_t* data, std::size_t size,
                          double now_s);
  // True if another sender is to be tried, on a new connection; *error says so.
  [[nodiscard]] bool trial_is_over(double now_s, std::string* error) const;

  // Number of the trial, for keep(). Each begin() increases it.
  [[nodiscard]] int trial() const;
  // A picture of that trial was decoded: its sender is kept, if no other trial has begun.
  void keep(int trial);
  // The kept sender's pictures are of no use.
  void give_up();

  [[nodiscard]] std::int64_t foreign() const;
  [[nodiscard]] std::string foreign_kind() const;  // of the last; empty: none

 private:
  struct Sender {
    UdpSenders::Bytes address{};
    std::uint32_t source = 0;
    double heard_s = 0;
    int trials = 0;
  };

  [[nodiscard]] bool is_heard(const Sender& sender, double now_s) const {
    return now_s - sender.heard_s <= timeout_s_;
  }
  bool hear(const UdpSenders::Bytes& address, std::uint32_t source, double now_s);
  void follow(std::size_t which, double now_s);
  bool leave_out(const UdpSenders::Bytes& address, std::uint32_t source);
  [[nodiscard]] static std::string name_of(const UdpSenders::Bytes& address, std::uint32_t source);

  const double timeout_s_;
  mutable std::mutex mutex_;  // guards the following
  int payload_type_ = -1;
  std::optional<std::uint32_t> source_;
  bool by_address_ = true;
  std::vector<Sender> known_;            // at most kMostKnown
  std::optional<std::size_t> followed_;  // of known_
  bool kept_ = false;
  double since_s_ = 0;  // start of the trial
  int trial_ = 0;
  std::int64_t foreign_ = 0;
  std::string foreign_kind_;
};

}  // namespace alidade

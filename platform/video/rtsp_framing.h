#pragma once
// RtspFraming: the packets and messages in the bytes of an RTSP connection (RFC 2326, 10.12), and what stands between them.
//
//   '$' channel length(16 bits) packet      RTP or RTCP: version 2, 8 bytes or more; or nothing
//   "RTSP/1.0 ..." or "METHOD ..."          a message: printable head, empty line, body by Content-Length. Before
//                                           set_channels() other letters than ASCII's may stand in the head, too
// Line ends between them mean nothing. All else is garbage, passed over byte by byte up to what can be the next packet
// or message: there only a packet on one of the known channels.
// Bytes in, views out; each byte is looked at a few times, memory is bounded. No I/O. One thread at a time.

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace alidade {

class RtspFraming {
 public:
  static constexpr std::size_t kMaxMessage = 64 << 10;   // bytes, with its body
  static constexpr std::size_t kMaxGarbage = 256 << 10;  // bytes in a row

  struct Item {
    enum class Kind { kNone, kPacket, kMessage };
    Kind kind = Kind::kNone;  // kNone: more bytes must come first
    int channel = 0;
    std::string_view bytes;  // valid until room() is called
    double arrival_s = 0;    // of its last byte
  };

  RtspFraming();

  // first: for RTP; the next is RTCP's.
  void set_channels(int first) {
    first_channel_ = first;
    packets_ = true;
  }

  // Where bytes may be written; then how many were.
  [[nodiscard]] std::pair<char*, std::size_t> room();
  void came(std::size_t bytes, double arrival_s);

  [[nodiscard]] Item next();

  // Bytes that belong to no packet and no message.
  [[nodiscard]] std::int64_t garbage() const { return garbage_; }
  // Some of them began as a message that says it is longer than kMaxMessage.
  [[nodiscard]] bool had_long_message() const { return had_long_message_; }
  // More than kMaxGarbage of them in a row: it is no RTSP, and nothing more is found.
  [[nodiscard]] bool is_lost() const { return garbage_in_a_row_ > kMaxGarbage; }

 private:
  enum class Guess { kNot, kTooLong, kMayBecome, kIs };
  struct Extent {
    Guess guess = Guess::kNot;
    std::size_t size = 0;  // of kIs
  };
  [[nodiscard]] Extent packet_at(std::string_view bytes) const;
  [[nodiscard]] Extent message_at(std::string_view bytes) const;

  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  double arrival_s_ = 0;
  int first_channel_ = 0;
  bool packets_ = false;  // are expected
  bool had_long_message_ = false;
  std::int64_t garbage_ = 0;
  std::size_t garbage_in_a_row_ = 0;
};

}  // namespace alidade

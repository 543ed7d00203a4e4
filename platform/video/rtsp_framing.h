#pragma once
// RtspFraming: splits the bytes of an RTSP connection (RFC 2326, 10.12) into packets and messages.
//   '$' channel length(16 bits) packet      RTP or RTCP: version 2, 8 bytes or more; or empty
//   "RTSP/1.0 ..." or "METHOD ..."          a message: printable head, empty line, body by
//                                           Content-Length. Before set_channels() the head may
//                                           have any byte but NUL
// Line ends between packets and messages are ignored. Anything else is garbage, skipped byte by
// byte up to a possible packet or message. A packet after garbage must be on one of the known
// channels. No I/O; a byte is examined a few times, one of garbage some hundred times; memory is
// bounded. One thread at a time.

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace alidade {

class RtspFraming {
 public:
  static constexpr std::size_t kMaxMessage = 64 << 10;   // bytes, with its body
  static constexpr std::size_t kMaxHead = 16 << 10;      // bytes of its first line and headers
  static constexpr std::size_t kMaxGarbage = 256 << 10;  // bytes in sequence

  struct Item {
    enum class Kind { kNone, kPacket, kMessage };
    Kind kind = Kind::kNone;  // kNone: more bytes are needed
    int channel = 0;
    std::string_view bytes;  // valid until room() is called
    double arrival_s = 0;    // of its last byte
  };

  RtspFraming();

  // first: the RTP channel; RTCP has the next one.
  void set_channels(int first) {
    first_channel_ = first;
    packets_ = true;
  }

  // room(): where to write bytes. came(): how many were written, and when (s). Then next() is to be
  // called until it returns kNone: else arrival_s is of later bytes, and room() may become empty.
  [[nodiscard]] std::pair<char*, std::size_t> room();
  void came(std::size_t bytes, double arrival_s);

  [[nodiscard]] Item next();

  // Bytes that belong to no packet and no message.
  [[nodiscard]] std::int64_t garbage() const { return garbage_; }
  // True if some garbage started as a message longer than kMaxMessage, or with a head longer than
  // kMaxHead.
  [[nodiscard]] bool had_long_message() const { return had_long_message_; }
  // True after more than kMaxGarbage bytes of garbage in sequence: this is not RTSP, and parsing
  // has stopped.
  [[nodiscard]] bool is_lost() const { return garbage_in_a_row_ > kMaxGarbage; }

 private:
  enum class Guess { kNot, kTooLong, kMayBecome, kIs };
  struct Extent {
    Guess guess = Guess::kNot;
    std::size_t size = 0;  // for kIs
  };
  [[nodiscard]] Extent packet_at(std::string_view bytes) const;
  [[nodiscard]] Extent message_at(std::string_view bytes) const;

  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  double arrival_s_ = 0;
  int first_channel_ = 0;
  bool packets_ = false;  // packets are expected
  bool had_long_message_ = false;
  std::int64_t garbage_ = 0;
  std::size_t garbage_in_a_row_ = 0;
};

}  // namespace alidade

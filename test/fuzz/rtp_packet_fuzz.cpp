// RTP packets as they come in, and the pieces of pictures that libavformat makes of them. An input is a list:
// a byte that tells what comes (its high bit: a piece, with its time stamp) and, for a packet, how long
// it is. Times are of this era; what follows a packet's header changes nothing of it; no more pictures end
// than markers came.

#include "platform/video/picture_ends.h"
#include "platform/video/rtp_packet.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

constexpr double kYear1968_s = -63'072'000;
constexpr double kYear2104_s = kYear1968_s + 4'294'967'296.0;

std::optional<RtpHeader> parse(const std::string& packet) {
  return parse_rtp_header(reinterpret_cast<const std::uint8_t*>(packet.data()), packet.size());
}

std::optional<RtpHeader> parse_soundly(const std::string& packet) {
  const auto header = parse(packet);
  if (!header) return header;
  if (header->capture_utc_s) {
    FUZZ_REQUIRE(*header->capture_utc_s > kYear1968_s - 86400 * 20);
    FUZZ_REQUIRE(*header->capture_utc_s < kYear2104_s + 86400 * 20);
  }
  // One that is cut off in its extension becomes whole by more bytes, but loses nothing.
  const auto longer = parse(packet + "more");
  FUZZ_REQUIRE(longer && longer->marker == header->marker);
  FUZZ_REQUIRE(longer->sequence == header->sequence && longer->timestamp == header->timestamp);
  FUZZ_REQUIRE(!header->capture_utc_s || longer->capture_utc_s == header->capture_utc_s);
  return header;
}

// Moving changes nothing but the time stamp.
void move_soundly(BearableTimestamps& timestamps, const std::string& packet) {
  std::string moved = packet;
  timestamps.move(reinterpret_cast<std::uint8_t*>(moved.data()), moved.size());
  const auto before = parse(packet);
  const auto after = parse(moved);
  FUZZ_REQUIRE(before.has_value() == after.has_value());
  FUZZ_REQUIRE(!before || (before->marker == after->marker && before->sequence == after->sequence &&
                           before->capture_utc_s == after->capture_utc_s));
  if (before) {
    const std::uint32_t shift = after->timestamp - before->timestamp;
    FUZZ_REQUIRE(shift == 0 || shift == 90'000 || after->timestamp == 0xFFFF'FFFE);
    FUZZ_REQUIRE(shift != 0 || moved == packet);
  }
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  PictureEnds ends;
  BearableTimestamps timestamps;
  int markers = 0;
  int last_pieces = 0;
  while (!input.empty()) {
    const unsigned what = input.byte();
    if ((what & 0x80U) != 0) {
      std::int64_t pts = 0;
      const std::string_view bytes = input.bytes(sizeof pts);
      std::memcpy(&pts, bytes.data(), bytes.size());
      const PictureEnds::Piece piece = ends.piece_out(pts);
      last_pieces += piece.last ? 1 : 0;
      FUZZ_REQUIRE(last_pieces <= markers);
      if (piece.last) {
        (void)ends.loss_of(pts);
        FUZZ_REQUIRE(ends.loss_of(pts).within);  // nothing has come of it since
      }
    } else {
      const std::string packet(input.bytes(what));
      move_soundly(timestamps, packet);
      if (const auto header = parse_soundly(packet)) {
        ends.packet_in(*header);
        markers += header->marker ? 1 : 0;
      }
    }
  }
  return 0;
}

// The bytes of an RTSP connection, its first byte the channel: in whatever pieces they come, the packets and messages
// are the same, each byte is of one of them or garbage, and garbage before packets that are well formed hides no more
// than what can be taken for one.

#include "platform/video/rtsp_framing.h"

#include <random>
#include <vector>

#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

struct Framed {
  std::vector<std::string> items;
  std::int64_t garbage = 0;
};

template <class NextPiece>
Framed frame(int channel, std::string_view bytes, NextPiece next_piece) {
  RtspFraming framing;
  framing.set_channels(channel);
  Framed result;
  std::size_t used = 0;
  const std::size_t all = bytes.size();
  while (!bytes.empty()) {
    const auto [room, size] = framing.room();
    FUZZ_REQUIRE(size > 0);
    const std::string_view piece = bytes.substr(0, std::min<std::size_t>(size, next_piece()));
    bytes.remove_prefix(piece.size());
    std::copy(piece.begin(), piece.end(), room);
    framing.came(piece.size(), 1);
    for (auto item = framing.next(); item.kind != RtspFraming::Item::Kind::kNone;
         item = framing.next()) {
      FUZZ_REQUIRE(!item.bytes.empty());
      FUZZ_REQUIRE(item.channel >= 0 && item.channel <= 255);
      if (item.kind == RtspFraming::Item::Kind::kPacket) {
        FUZZ_REQUIRE(static_cast<unsigned char>(item.bytes[0]) >> 6U == 2);
      } else {
        FUZZ_REQUIRE(item.bytes.size() <= RtspFraming::kMaxMessage);
      }
      used += item.bytes.size();
      result.items.emplace_back(std::to_string(item.channel) + ":" + std::string(item.bytes));
    }
  }
  result.garbage = framing.garbage();
  FUZZ_REQUIRE(used + static_cast<std::size_t>(result.garbage) <= all);
  return result;
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  const int channel = input.byte() % 254;
  const std::string_view bytes = input.rest();
  const Framed whole = frame(channel, bytes, [&] { return bytes.size(); });
  std::minstd_rand random(static_cast<unsigned>(size));
  const auto next_piece = [&] { return 1 + random() % (random() % 4 == 0 ? 200 : 5); };
  const Framed pieces = frame(channel, bytes, next_piece);
  FUZZ_REQUIRE(pieces.items == whole.items);
  FUZZ_REQUIRE(pieces.garbage == whole.garbage);
  return 0;
}

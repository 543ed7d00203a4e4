// VISCA with and without the header of its datagrams: options, then a conversation. Besides: a frame that
// ends what came before is found, and a datagram's header is read as it stands there.

#include "platform/pan_tilt/visca_protocol.h"
#include "test/fuzz/head_conversation.h"

namespace alidade {
namespace {

// Pan 4660 and tilt -2 in 5+4 nibbles.
void require_found_behind(std::string_view noise, int address) {
  std::string bytes(noise);
  bytes += static_cast<char>(0x80 + 16 * address);
  bytes.append("\x50\x00\x01\x02\x03\x04\x0F\x0F\x0F\x0E\xFF", 11);
  const auto found = find_visca_frame(bytes, address);
  FUZZ_REQUIRE(found);
  FUZZ_REQUIRE(found->kind == ViscaFrame::Kind::kPosition);
  FUZZ_REQUIRE(found->begin == noise.size() && found->length == 12);
  FUZZ_REQUIRE(found->pan == 0x1234 && found->tilt == -2);
}

void require_header_read(std::string_view payload) {
  if (payload.empty() || payload.size() > 0xFFFF) return;
  std::string datagram("\x01\x11", 2);
  datagram += static_cast<char>(payload.size() / 256);
  datagram += static_cast<char>(payload.size() % 256);
  datagram += "\x89\xAB\xCD\xEF";
  datagram += payload;
  const auto header = parse_visca_header(datagram);
  FUZZ_REQUIRE(header);
  FUZZ_REQUIRE(header->type == 0x0111 && header->sequence == 0x89ABCDEF);
  FUZZ_REQUIRE(header->payload == payload);
  FUZZ_REQUIRE(!parse_visca_header(std::string_view(datagram).substr(0, datagram.size() - 1)));
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  const unsigned bits = input.byte();
  ViscaOptions options;
  options.address = std::max<int>(static_cast<int>(bits & 7U), 1);
  options.header = (bits & 8U) != 0;
  options.read_zoom = (bits & 16U) != 0;
  options.pan_deg_per_step = (bits & 32U) != 0 ? 10 : 1 / 51.2;
  options.tilt_deg_per_step = (bits & 64U) != 0 ? 1e-6 : 1 / 14.4;
  require_found_behind(input.rest(), options.address);
  require_header_read(input.rest());
  ViscaProtocol protocol(options);
  converse(&protocol, &input);
  return 0;
}

// FLIR PTU: options, then a conversation. Besides: a whole line after whatever came is read.

#include "platform/pan_tilt/ptu_protocol.h"
#include "test/fuzz/head_conversation.h"

namespace alidade {
namespace {

void require_found_behind(std::string_view noise) {
  std::string bytes(noise);
  bytes += "\r\n* Current Pan position is -1000\r\n";
  const auto found = find_ptu_line(bytes);
  FUZZ_REQUIRE(found);
  FUZZ_REQUIRE(found->kind == PtuLine::Kind::kNumber && found->number == -1000);
  FUZZ_REQUIRE(found->words == "current pan position is");
  FUZZ_REQUIRE(found->begin == noise.size() + 2);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  const unsigned bits = input.byte();
  PtuOptions options;
  options.verbose = (bits & 1U) != 0;
  if ((bits & 2U) != 0) options.pan_deg_per_step = 185.1428 / 3600;
  if ((bits & 4U) != 0) options.tilt_deg_per_step = 10;
  require_found_behind(input.rest());
  PtuProtocol protocol(options);
  converse(&protocol, &input);
  return 0;
}

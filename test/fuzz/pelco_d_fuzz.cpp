// Pelco-D: address, options, then a conversation. Besides: whatever noise comes first, the answer that
// follows it is found, or one that began within the noise and overlaps it.

#include "platform/pan_tilt/pelco_d_protocol.h"
#include "test/fuzz/head_conversation.h"

namespace alidade {
namespace {

constexpr std::uint8_t kPanAnswer = 0x59;
constexpr std::size_t kFrame = 7;  // bytes

void require_found_behind(std::string_view noise, int address) {
  std::string bytes(noise);
  bytes += pelco_d_query(address, kPanAnswer);  // as long as an answer, with a right sum
  std::string problem;
  const auto found = find_pelco_d_answer(bytes, address, kPanAnswer, &problem);
  FUZZ_REQUIRE(found);
  FUZZ_REQUIRE(found->begin + kFrame > noise.size());
  FUZZ_REQUIRE(found->begin != noise.size() || found->value == 0);
  FUZZ_REQUIRE(problem.empty());
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  PelcoDOptions options;
  options.address = std::max<int>(input.byte(), 1);
  const unsigned bits = input.byte();
  options.read_zoom = (bits & 1U) != 0;
  options.pan_deg_per_step = (bits & 2U) != 0 ? 10 : 0.01;
  options.tilt_deg_per_step = (bits & 4U) != 0 ? 1e-6 : 0.01;
  require_found_behind(input.rest(), options.address);
  PelcoDProtocol protocol(options);
  converse(&protocol, &input);
  return 0;
}

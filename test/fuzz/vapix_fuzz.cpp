// The text answer of an Axis camera: a position within a turn, or one line that says why there is none.

#include "platform/pan_tilt/vapix_answer.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  constexpr double kTurn_rad = 6.2831853071795872;
  VapixPosition position;
  std::string error;
  if (!parse_vapix_position(text_of(data, size), &position, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.size() < longest_error(120));
    return 0;
  }
  FUZZ_REQUIRE(error.empty());
  FUZZ_REQUIRE(std::abs(position.pan_rad) <= kTurn_rad);
  FUZZ_REQUIRE(std::abs(position.tilt_rad) <= kTurn_rad);
  FUZZ_REQUIRE(!position.zoom || std::isfinite(*position.zoom));
  return 0;
}

// A picture of H.264 or H.265 as a camera sends it, or not; the first byte tells which. Once its parameter sets say that
// nothing may be reordered, nothing is left to be changed, and what is known of the picture is the same.

#include "platform/video/coded_picture.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  const CodedBy codec = (input.byte() & 1U) == 0 ? CodedBy::kH264 : CodedBy::kH265;
  const std::string_view text = input.rest();
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  const CodedPicture picture = look_at(codec, bytes, text.size());
  FUZZ_REQUIRE(!picture.right_after ||
               (*picture.right_after >= 0 && *picture.right_after <= 1 << 15));
  const auto changed = without_reordering(codec, bytes, text.size());
  if (!changed) return 0;
  FUZZ_REQUIRE(!changed->empty());
  const CodedPicture after = look_at(codec, changed->data(), changed->size());
  FUZZ_REQUIRE(after.has_beginning == picture.has_beginning);
  FUZZ_REQUIRE(after.needs_no_other == picture.needs_no_other);
  FUZZ_REQUIRE(after.right_after == picture.right_after);
  FUZZ_REQUIRE(!without_reordering(codec, changed->data(), changed->size()));
  return 0;
}

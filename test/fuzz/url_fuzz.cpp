// A URL with its user and password. What is shown of it holds neither, and is one line.

#include "platform/system/byte_link.h"
#include "platform/system/url.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string text(text_of(data, size));
  static_cast<void>(is_byte_link_url(text));
  Url url;
  std::string error;
  if (!parse_url(text, &url, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(url.shown.empty() || is_one_line(url.shown));
    return 0;
  }
  FUZZ_REQUIRE(is_one_line(url.shown));
  Url bare;
  // Not always: what libcurl accepts it need not write so that it accepts it again (file:A//%tmp).
  if (!parse_url(url.bare, &bare, &error)) return 0;
  FUZZ_REQUIRE(bare.user.empty() && bare.password.empty());
  return 0;
}

// A session description: what it says of a video can be listened to, and put into the line of a request.

#include "platform/video/session_description.h"
#include "test/fuzz/fuzz_target.h"

namespace {

bool has_no_line_end(const std::string& text) {
  return text.find_first_of(std::string_view("\r\n\0", 3)) == std::string::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const auto video = find_video(std::string(text_of(data, size)));
  if (!video) return 0;
  FUZZ_REQUIRE(video->port >= 0 && video->port <= 65535);
  FUZZ_REQUIRE(!video->address.empty() && has_no_line_end(video->address));
  FUZZ_REQUIRE(has_no_line_end(video->control) && has_no_line_end(video->session_control));
  return 0;
}

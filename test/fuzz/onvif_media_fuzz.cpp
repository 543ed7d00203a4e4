// One body of bytes read as every answer of ONVIF about a device and its streams. Numbers are
// within their bounds, a stream's URL leads to the device's own host, and no user or password is in
// it.

#include "edge_app/setup/stream_choice.h"
#include "platform/discovery/onvif_inquiry.h"
#include "platform/discovery/onvif_media.h"
#include "platform/system/url.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

void require_refusal(const std::string& error) {
  FUZZ_REQUIRE(is_one_line(error));
  FUZZ_REQUIRE(error.size() < longest_error(120, 80));
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string_view body = text_of(data, size);
  std::string error;
  DeviceReport report;
  if (!parse_onvif_device(body, &report, &error)) require_refusal(error);
  FUZZ_REQUIRE(parse_onvif_media2(body).size() <= 2000);
  std::vector<VideoStream> streams;
  if (parse_onvif_streams(body, &streams, &error)) {
    FUZZ_REQUIRE(!streams.empty() && streams.size() <= 64);
    for (const VideoStream& stream : streams) {
      FUZZ_REQUIRE(!stream.token.empty());
      FUZZ_REQUIRE(stream.width >= 0 && stream.height >= 0 && stream.key_frame_distance >= 0);
      FUZZ_REQUIRE(std::isfinite(stream.rate_hz) && stream.rate_hz >= 0 && stream.rate_hz <= 1000);
    }
    const StreamChoice choice = choose_stream(streams);
    FUZZ_REQUIRE(choice.remarks.size() == streams.size());
    FUZZ_REQUIRE(!choice.best || *choice.best < streams.size());
    FUZZ_REQUIRE(is_one_line(choice.reason));
  } else {
    require_refusal(error);
  }
  std::string url;
  if (parse_onvif_stream_url(body, &url, &error)) {
    bool moved = false;
    const std::string usable = usable_stream_url(url, "192.0.2.1", &moved);
    Url parsed;
    if (!usable.empty() && parse_url(usable, &parsed, &error)) {
      FUZZ_REQUIRE(parsed.host == "192.0.2.1");
      FUZZ_REQUIRE(parsed.user.empty() && parsed.password.empty());
    }
  } else {
    require_refusal(error);
  }
  return 0;
}

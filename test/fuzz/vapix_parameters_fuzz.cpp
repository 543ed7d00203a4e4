// Any bytes taken for the parameters of an Axis device: the streams that they lead to have URLs at
// the device's own host.

#include "edge_app/setup/stream_choice.h"
#include "platform/discovery/vapix_parameters.h"
#include "platform/system/url.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  DeviceReport report;
  std::string error;
  if (!parse_vapix_parameters(text_of(data, size), "192.0.2.1", &report, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.size() < longest_error(120, 80));
    FUZZ_REQUIRE(report.streams.empty());
    return 0;
  }
  FUZZ_REQUIRE(!report.streams.empty() && report.streams.size() <= 48);
  for (const VideoStream& stream : report.streams) {
    FUZZ_REQUIRE(stream.width > 0 && stream.width <= 65535 && stream.height > 0);
    Url url;
    FUZZ_REQUIRE(parse_url(stream.url, &url, &error));
    FUZZ_REQUIRE(url.host == "192.0.2.1" && url.scheme == "rtsp");
  }
  FUZZ_REQUIRE(is_one_line(choose_stream(report.streams).reason));
  return 0;
}

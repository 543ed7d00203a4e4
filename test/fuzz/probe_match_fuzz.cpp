// Any datagram taken for an answer of WS-Discovery. What is read is bounded, what is not read says
// why in one line, and the URL that is asked is http at a host.

#include "platform/discovery/found_devices.h"
#include "platform/discovery/probe_match.h"
#include "platform/system/url.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  std::vector<ProbeMatch> matches;
  std::string error;
  if (!parse_probe_matches(text_of(data, size), {"uuid:11111111-2222-4333-8444-555555555555"},
                           &matches, &error)) {
    FUZZ_REQUIRE(matches.empty());
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.size() < longest_error(120, 80));
    return 0;
  }
  FUZZ_REQUIRE(matches.size() <= 16);
  FoundDevices found;
  for (const ProbeMatch& match : matches) {
    FUZZ_REQUIRE(match.endpoint.size() <= 256 && match.name.size() <= 256);
    FUZZ_REQUIRE(match.types.size() <= 64 && match.addresses.size() <= 64);
    found.add(match, {"192.0.2.1", "eth0"});
    found.add(match, {"fe80::1%eth1", "eth1"});
  }
  for (const FoundDevice& device : found.list()) {
    Url url;
    FUZZ_REQUIRE(parse_url(device.onvif_url, &url, &error));
    FUZZ_REQUIRE(url.scheme == "http" || url.scheme == "https");
    FUZZ_REQUIRE(!url.host.empty() && url.host == device.host);
    FUZZ_REQUIRE(url.user.empty() && url.password.empty());
    FUZZ_REQUIRE(device.note.empty() || is_one_line(device.note));
  }
  return 0;
}

// Any datagram taken for an answer of DNS-SD. The first two bytes are those of the question's id.
// What is read is bounded; what is not read says why in one line; the URL that is asked is http at
// a host.

#include "platform/discovery/dns_sd.h"
#include "platform/discovery/found_devices.h"
#include "platform/system/url.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::vector<std::string> types = {"_axis-video._tcp.local", "_vapix-https._tcp.local"};
  std::vector<DnsService> services;
  std::string error;
  if (!parse_dns_sd_answer(text_of(data, size), types, 0x1234, &services, &error)) {
    FUZZ_REQUIRE(services.empty());
    FUZZ_REQUIRE(is_one_line(error));
    return 0;
  }
  FUZZ_REQUIRE(services.size() <= 64);
  FoundDevices found;
  for (const DnsService& service : services) {
    FUZZ_REQUIRE(service.port >= 0 && service.port <= 65535);
    FUZZ_REQUIRE(service.addresses.size() <= 8);
    found.add(service, {"192.0.2.1", "eth0"});
  }
  for (const FoundDevice& device : found.list()) {
    Url url;
    FUZZ_REQUIRE(parse_url(device.vapix_url, &url, &error));
    FUZZ_REQUIRE((url.scheme == "http" || url.scheme == "https") && !url.host.empty());
  }
  return 0;
}

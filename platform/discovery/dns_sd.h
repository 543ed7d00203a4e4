#pragma once
// DNS-SD over multicast DNS (RFC 6763, 6762): the question "who offers this service?" to
// 224.0.0.251 and ff02::fb, port 5353, and the answers. It is asked from a port of our own, so that
// devices answer to that port alone (RFC 6762, 6.7) and a resolver of this machine is not
// disturbed. libresolv takes the messages apart. No side effects: bytes in, values or a one-line
// error out.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace alidade {

inline constexpr std::uint16_t kMulticastDnsPort = 5353;
inline constexpr const char* kMulticastDnsGroup4 = "224.0.0.251";
inline constexpr const char* kMulticastDnsGroup6 = "ff02::fb";

// One instance of a service.
struct DnsService {
  std::string instance;                // "AXIS Q6075 - ACCC8E012345"
  std::string type;                    // "_axis-video._tcp.local"
  std::string host;                    // "axis-accc8e012345.local"; empty: not told
  int port = 0;                        // 0: not told
  std::vector<std::string> addresses;  // numeric; of the host
};

// types: "_axis-video._tcp.local". id: to know the answers by, not 0.
[[nodiscard]] std::string dns_sd_question(const std::vector<std::string>& types, std::uint16_t id);

// False: not an answer to this question; *error says what is wrong. Services of other types are
// left out, and whatever exceeds 64 services, 8 addresses of a service or 256 records of a section.
[[nodiscard]] bool parse_dns_sd_answer(std::string_view datagram,
                                       const std::vector<std::string>& types, std::uint16_t id,
                                       std::vector<DnsService>* services, std::string* error);

}  // namespace alidade

#pragma once
// FoundDevices: the devices that answered a search, each once, however often and on however many
// interfaces it answered, and the URL at which to ask it. No I/O. At most kMostDevices; further
// ones are left out.
//
// Which of the reported URLs is best: one whose host is the address that the answer came from; then
// IPv4, a name, IPv4 of 169.254, IPv6; of the same kind http before https, whose certificate
// cameras sign themselves. A link-local IPv6 address needs the interface behind it:
// [fe80::1%25eth0].

#include <cstddef>
#include <string>
#include <vector>

#include "platform/discovery/dns_sd.h"
#include "platform/discovery/probe_match.h"

namespace alidade {

struct FoundDevice {
  std::string endpoint;   // WS-Discovery's identifier; empty: found by DNS-SD alone
  std::string name;       // as it reports itself; may be empty
  std::string hardware;   // the model; may be empty
  std::string host;       // of the best URL: numeric address, or what the device reports
  std::string onvif_url;  // of its device service; empty: no ONVIF is reported
  std::string vapix_url;  // http://host[:port]; empty: no VAPIX is reported
  std::string interface;  // over which the answer came: "eth0"
  std::string note;       // what is odd about its answer; empty: nothing
};

// Where an answer came from. address: numeric, IPv6 with its zone: "fe80::1%eth0".
struct AnswerOrigin {
  std::string address;
  std::string interface;
};

// The URL to use of those that a device reports; empty: none can be used. rank: smaller is better.
[[nodiscard]] std::string best_address(const std::vector<std::string>& reported,
                                       const AnswerOrigin& origin, int* rank);

// The note of a device that has no other address.
inline constexpr const char* kLinkLocalOnly =
    "it answers from a link-local IPv6 address only, which no configuration can name; give the "
    "camera an IPv4 address";

class FoundDevices {
 public:
  static constexpr std::size_t kMostDevices = 256;

  void add(const ProbeMatch& match, const AnswerOrigin& origin);
  void add(const DnsService& service, const AnswerOrigin& origin);
  // In order of their addresses.
  [[nodiscard]] std::vector<FoundDevice> list() const;

 private:
  struct Entry {
    FoundDevice device;
    int rank = 0;  // of onvif_url, or of vapix_url if there is no other
  };
  Entry* entry_of(const std::string& endpoint, const std::string& host);

  std::vector<Entry> entries_;
};

}  // namespace alidade

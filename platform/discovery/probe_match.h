#pragma once
// WS-Discovery (OASIS, the version of April 2005 that ONVIF prescribes): the question "which
// devices are there?", sent to 239.255.255.250 and ff02::c, port 3702, and the answers. No side
// effects: bytes in, values or a one-line error out. Anybody on the network can send an answer, so
// its content is limited in number and length, and shows only where a device may be asked.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace alidade {

inline constexpr std::uint16_t kWsDiscoveryPort = 3702;
inline constexpr const char* kWsDiscoveryGroup4 = "239.255.255.250";
inline constexpr const char* kWsDiscoveryGroup6 = "ff02::c";

// One device in an answer.
struct ProbeMatch {
  std::string endpoint;  // "urn:uuid:...": the device, whatever its addresses; empty: not given
  std::vector<std::string> types;  // without prefixes: NetworkVideoTransmitter
  // From its scopes, decoded; empty: not given.
  std::string name;
  std::string hardware;
  std::vector<std::string> addresses;  // URLs of its service, http:// or https://, as reported
  bool is_onvif = false;               // by its types or scopes; printers answer, too
};

// The question. message_id: "urn:uuid:..." or "uuid:...", new for each question. for_cameras: only
// network video transmitters are to answer. Some devices answer only with, others only without it.
[[nodiscard]] std::string probe_message(const std::string& message_id, bool for_cameras);

// False: not an answer to one of our questions; *error says what is wrong. message_ids: of the
// questions sent. An answer that names no question is accepted. Left out is whatever exceeds 16
// devices, 64 types, scopes or addresses of a device, or 256 bytes for one of these.
[[nodiscard]] bool parse_probe_matches(std::string_view datagram,
                                       const std::vector<std::string>& message_ids,
                                       std::vector<ProbeMatch>* matches, std::string* error);

}  // namespace alidade

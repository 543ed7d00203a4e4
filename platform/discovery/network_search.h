#pragma once
// search_network(): asks for cameras on every network of this machine, by WS-Discovery (ONVIF) and
// by DNS-SD over multicast DNS (Axis: VAPIX), over IPv4 and IPv6, and gathers the answers for some
// seconds. Each question is sent three times, as datagrams get lost. Multicast stays on the local
// network: what is behind a router does not answer. Answers come to ports of our own. The call
// blocks for duration_s, less if 4096 answers came before.

#include <string>
#include <vector>

#include "platform/discovery/found_devices.h"

namespace alidade {

struct NetworkSearchOptions {
  double duration_s = 4;
  std::string interface;  // "eth0"; empty: all but the loopback
};

struct NetworkSearchResult {
  std::vector<FoundDevice> devices;
  std::vector<std::string> interfaces;  // that were asked
  // One line each, 8 at most: what could not be asked, and what answered something else.
  std::vector<std::string> notes;
};

[[nodiscard]] NetworkSearchResult search_network(const NetworkSearchOptions& options);

}  // namespace alidade

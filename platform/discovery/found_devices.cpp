#include "platform/discovery/found_devices.h"

#include <arpa/inet.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>

#include "platform/system/url.h"

namespace alidade {
namespace {

// Smaller is better. Two of a kind differ by their scheme.
enum AddressRank : int {
  kOfTheAnswer = 0,
  kIpv4 = 2,
  kName = 4,
  kIpv4LinkLocal = 6,
  kIpv6 = 8,
  kIpv6LinkLocal = 10
};

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

std::string without_zone(const std::string& address) {
  return address.substr(0, address.find('%'));
}

// The host of a URL without brackets and zone.
std::string bare_host(const Url& url) {
  std::string host = url.host;
  if (!host.empty() && host.front() == '[') host = host.substr(1, host.find(']') - 1);
  return without_zone(host);
}

bool is_link_local_6(const std::string& host) {
  in6_addr address{};
  return ::inet_pton(AF_INET6, host.c_str(), &address) == 1 && address.s6_addr[0] == 0xFE &&
         (address.s6_addr[1] & 0xC0U) == 0x80U;
}

bool is_ipv6(const std::string& host) { return host.find(':') != std::string::npos; }

int rank_of(const std::string& host, const AnswerOrigin& origin) {
  if (::strcasecmp(host.c_str(), without_zone(origin.address).c_str()) == 0 && !is_ipv6(host))
    return kOfTheAnswer;
  if (is_ipv4(host)) return host.rfind("169.254.", 0) == 0 ? kIpv4LinkLocal : kIpv4;
  if (!is_ipv6(host)) return kName;
  return is_link_local_6(host) ? kIpv6LinkLocal : kIpv6;
}

// Nobody can be reached there.
bool is_nowhere(const std::string& host) {
  return host.empty() || host == "0.0.0.0" || host == "::" || host == "::1" ||
         host.rfind("127.", 0) == 0 || host == "localhost";
}

// As the host of a URL: an IPv6 address in brackets, a link-local one with its zone.
std::string url_host(const std::string& host, const std::string& interface) {
  if (!is_ipv6(host)) return host;
  return "[" + host + (is_link_local_6(host) ? "%25" + interface : std::string()) + "]";
}

}  // namespace

std::string best_address(const std::vector<std::string>& reported, const AnswerOrigin& origin,
                         int* rank) {
  std::string best;
  for (const std::string& address : reported) {
    Url url;
    std::string ignored;
    // libcurl would take the path of http:///onvif for a host.
    if (address.find(":///") != std::string::npos || !parse_url(address, &url, &ignored)) continue;
    const std::string host = bare_host(url);
    if (is_nowhere(host)) continue;
    const int its = rank_of(host, origin) + (url.scheme == "https" ? 1 : 0);
    if (!best.empty() && its >= *rank) continue;
    *rank = its;
    best = url.scheme + "://" + url_host(host, origin.interface) +
           (url.port.empty() ? "" : ":" + url.port) + url.path;
  }
  return best;
}

FoundDevices::Entry* FoundDevices::entry_of(const std::string& endpoint, const std::string& host) {
  for (Entry& entry : entries_) {
    const FoundDevice& device = entry.device;
    const bool same_endpoint =
        !endpoint.empty() && ::strcasecmp(device.endpoint.c_str(), endpoint.c_str()) == 0;
    const bool same_host = device.host == host && (endpoint.empty() || device.endpoint.empty());
    if (same_endpoint || same_host) return &entry;
  }
  if (entries_.size() == kMostDevices) return nullptr;
  entries_.emplace_back();
  entries_.back().device.host = host;
  entries_.back().rank = kIpv6LinkLocal + 2;
  return &entries_.back();
}

void FoundDevices::add(const ProbeMatch& match, const AnswerOrigin& origin) {
  if (!match.is_onvif) return;
  const std::string from = url_host(without_zone(origin.address), origin.interface);
  int rank = kOfTheAnswer;
  std::string url = best_address(match.addresses, origin, &rank);
  std::string note;
  if (url.empty()) {
    url = "http://" + from + "/onvif/device_service";
    rank = is_ipv6(from) ? kIpv6LinkLocal : kOfTheAnswer;
    note = "it reports no address that can be used; it is asked where its answer came from";
  } else if (rank > kOfTheAnswer + 1 && !is_ipv6(from)) {
    note = "its answer came from " + from + ", which it does not report as its address";
  }
  Url parsed;
  std::string ignored;
  if (!parse_url(url, &parsed, &ignored)) return;
  Entry* const entry = entry_of(match.endpoint, parsed.host);
  if (entry == nullptr) return;
  FoundDevice& device = entry->device;
  device.endpoint = match.endpoint.empty() ? device.endpoint : match.endpoint;
  device.name = match.name.empty() ? device.name : match.name;
  device.hardware = match.hardware.empty() ? device.hardware : match.hardware;
  if (!device.onvif_url.empty() && rank >= entry->rank) return;
  entry->rank = rank;
  device.onvif_url = url;
  device.host = parsed.host;
  device.interface = origin.interface;
  device.note = rank >= kIpv6LinkLocal ? kLinkLocalOnly : note;
}

void FoundDevices::add(const DnsService& service, const AnswerOrigin& origin) {
  std::vector<std::string> addresses;
  const bool by_tls = service.type.find("https") != std::string::npos;
  const std::string scheme = by_tls ? "https://" : "http://";
  const int usual = by_tls ? 443 : 80;
  const std::string port = service.port == 0 || service.port == usual
                               ? std::string()
                               : ":" + std::to_string(service.port);
  const auto add = [&](const std::string& host) {
    addresses.push_back(std::string(scheme).append(url_host(host, origin.interface)).append(port));
  };
  for (const std::string& address : service.addresses) add(address);
  add(without_zone(origin.address));
  int rank = kOfTheAnswer;
  std::string url = best_address(addresses, origin, &rank);
  if (url.empty()) return;
  if (url.back() == '/') url.pop_back();
  Url parsed;
  std::string ignored;
  if (!parse_url(url, &parsed, &ignored)) return;
  Entry* const entry = entry_of("", parsed.host);
  if (entry == nullptr) return;
  FoundDevice& device = entry->device;
  if (device.name.empty()) device.name = service.instance;
  // http:// is preferred: the certificate of https:// is the camera's own.
  if (device.vapix_url.empty() || (device.vapix_url.rfind("https://", 0) == 0 && !by_tls))
    device.vapix_url = url;
  if (device.interface.empty()) device.interface = origin.interface;
}

std::vector<FoundDevice> FoundDevices::list() const {
  std::vector<FoundDevice> devices;
  devices.reserve(entries_.size());
  for (const Entry& entry : entries_) devices.push_back(entry.device);
  // By number, not by letter: 192.0.2.9 before 192.0.2.10.
  const auto key = [](const FoundDevice& device) {
    in_addr address{};
    const bool numeric = ::inet_pton(AF_INET, device.host.c_str(), &address) == 1;
    const std::uint32_t number = numeric ? ntohl(address.s_addr) : 0;
    return std::make_tuple(!numeric, number, device.host);
  };
  std::sort(devices.begin(), devices.end(),
            [&key](const FoundDevice& a, const FoundDevice& b) { return key(a) < key(b); });
  return devices;
}

}  // namespace alidade

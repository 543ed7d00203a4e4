#include "platform/video/udp_senders.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

namespace alidade {
namespace {

constexpr std::array<std::uint8_t, 12> kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};

}  // namespace

std::optional<UdpSenders::Bytes> UdpSenders::bytes_of(const sockaddr_storage& address) {
  Bytes bytes{};
  if (address.ss_family == AF_INET6) {
    sockaddr_in6 ipv6{};
    std::memcpy(&ipv6, &address, sizeof ipv6);
    std::memcpy(bytes.data(), &ipv6.sin6_addr, bytes.size());
    return bytes;
  }
  if (address.ss_family != AF_INET) return std::nullopt;
  sockaddr_in ipv4{};
  std::memcpy(&ipv4, &address, sizeof ipv4);
  std::copy(kMapped.begin(), kMapped.end(), bytes.begin());
  std::memcpy(bytes.data() + kMapped.size(), &ipv4.sin_addr, sizeof ipv4.sin_addr);
  return bytes;
}

bool UdpSenders::add(const std::string& address) {
  sockaddr_storage storage{};
  sockaddr_in ipv4{};
  sockaddr_in6 ipv6{};
  if (::inet_pton(AF_INET, address.c_str(), &ipv4.sin_addr) == 1) {
    ipv4.sin_family = AF_INET;
    std::memcpy(&storage, &ipv4, sizeof ipv4);
  } else if (::inet_pton(AF_INET6, address.c_str(), &ipv6.sin6_addr) == 1) {
    ipv6.sin6_family = AF_INET6;
    std::memcpy(&storage, &ipv6, sizeof ipv6);
  }
  const std::optional<Bytes> bytes = bytes_of(storage);
  if (!bytes) return false;
  addresses_.push_back(*bytes);
  names_.push_back(address);
  return true;
}

bool UdpSenders::take(const sockaddr_storage& from) {
  if (empty()) return true;
  const std::optional<Bytes> bytes = bytes_of(from);
  if (bytes && std::find(addresses_.begin(), addresses_.end(), *bytes) != addresses_.end()) {
    return true;
  }
  ++foreign_;
  if (bytes) last_foreign_ = bytes;
  return false;
}

std::string UdpSenders::text_of(const Bytes& address) {
  const bool is_ipv4 = std::equal(kMapped.begin(), kMapped.end(), address.begin());
  char text[INET6_ADDRSTRLEN] = "";
  ::inet_ntop(is_ipv4 ? AF_INET : AF_INET6, address.data() + (is_ipv4 ? kMapped.size() : 0), text,
              sizeof text);
  return text;
}

std::string UdpSenders::foreign_kind() const {
  if (!last_foreign_) return "";
  return "another address (" + text_of(*last_foreign_) + " in place of " + names_.front() + ")";
}

}  // namespace alidade

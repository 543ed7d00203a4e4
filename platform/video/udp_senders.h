#pragma once
// UdpSenders: whose datagrams a socket takes, by IP address: anybody can send to an open port, and needs no password for it.
// A port is no part of it: cameras, and what stands in between, send from any. IPv4 and IPv6. No I/O; one thread at a time.

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

class UdpSenders {
 public:
  // False: not a numeric address.
  [[nodiscard]] bool add(const std::string& address);
  // None was added: anybody's are taken.
  [[nodiscard]] bool empty() const { return addresses_.empty(); }
  // The numeric addresses, as they were added.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

  // Whether this one's datagrams are taken; counts those that are not.
  [[nodiscard]] bool take(const sockaddr_storage& from);
  [[nodiscard]] std::int64_t foreign() const { return foreign_; }
  // Whose they are, in a person's words; empty: none came.
  [[nodiscard]] std::string foreign_kind() const;

 private:
  using Bytes = std::array<std::uint8_t, 16>;  // of IPv6; IPv4's as mapped there
  static std::optional<Bytes> bytes_of(const sockaddr_storage& address);

  std::vector<Bytes> addresses_;
  std::vector<std::string> names_;
  std::int64_t foreign_ = 0;
  std::optional<Bytes> last_foreign_;
};

}  // namespace alidade

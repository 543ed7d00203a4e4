#pragma once
// UdpSenders: whose datagrams a socket accepts, by IP address, as anyone can send to an open port
// without a password. The port is ignored: cameras and devices on the way send from any port. IPv4
// and IPv6. No I/O; one thread at a time.

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

class UdpSenders {
 public:
  using Bytes = std::array<std::uint8_t, 16>;  // IPv6, or IPv4 mapped to IPv6
  // nullopt: neither.
  [[nodiscard]] static std::optional<Bytes> bytes_of(const sockaddr_storage& address);
  [[nodiscard]] static std::string text_of(const Bytes& address);

  // False: not a numeric address.
  [[nodiscard]] bool add(const std::string& address);
  // True if none was added: all senders are accepted.
  [[nodiscard]] bool empty() const { return addresses_.empty(); }
  // The numeric addresses, as added.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

  // True if datagrams from this address are accepted; counts the others.
  [[nodiscard]] bool take(const sockaddr_storage& from);
  [[nodiscard]] std::int64_t foreign() const { return foreign_; }
  // A description of the others; empty: none came.
  [[nodiscard]] std::string foreign_kind() const;

 private:
  std::vector<Bytes> addresses_;
  std::vector<std::string> names_;
  std::int64_t foreign_ = 0;
  std::optional<Bytes> last_foreign_;
};

}  // namespace alidade

#pragma once
// NameLookup: the addresses of a host, by getaddrinfo(). Nothing can interrupt getaddrinfo(), and
// it takes minutes if a name server does not answer. Therefore it runs as an Errand: the owner
// waits with a deadline of its own, and may go away. Numeric addresses need no thread. Used by one
// thread at a time.

#include <sys/socket.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "platform/system/errand.h"

namespace alidade {

struct HostAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  [[nodiscard]] int family() const { return storage.ss_family; }
  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

class NameLookup {
 public:
  // socket_type: SOCK_STREAM or SOCK_DGRAM. IPv6 without brackets; a port in digits.
  NameLookup(std::string host, std::string port, int socket_type)
      : host_(std::move(host)), port_(std::move(port)), socket_type_(socket_type) {}

  // Begins a look-up, or goes on with a look-up whose result was not taken. False: no thread could
  // be started.
  [[nodiscard]] bool begin();
  [[nodiscard]] bool is_over() const { return errand_.is_over(); }
  // Readable when the look-up is over; negative: the look-up needed no thread.
  [[nodiscard]] int descriptor() const { return errand_.descriptor(); }
  // Once for each begin(), when the look-up is over: the addresses, in the resolver's order. Empty:
  // none, for the reason in *error.
  [[nodiscard]] std::vector<HostAddress> take(std::string* error);

 private:
  struct Found {
    int code = 0;  // of getaddrinfo()
    std::vector<HostAddress> addresses;
  };
  static Found look_up(const std::string& host, const std::string& port, int socket_type,
                       int flags);

  std::string host_;
  std::string port_;
  int socket_type_;
  std::shared_ptr<Found> found_;  // also the errand's; null: taken
  Errand errand_;
};

}  // namespace alidade

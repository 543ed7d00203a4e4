#include "platform/system/name_lookup.h"

#include <netdb.h>

#include <cstring>
#include <utility>

namespace alidade {

NameLookup::Found NameLookup::look_up(const std::string& host, const std::string& port,
                                      int socket_type, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = socket_type;
  hints.ai_flags = AI_NUMERICSERV | flags;
  addrinfo* list = nullptr;
  Found found;
  found.code = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &list);
  if (found.code != 0) return found;
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(list, &::freeaddrinfo);
  for (const addrinfo* each = list; each != nullptr; each = each->ai_next) {
    HostAddress& address = found.addresses.emplace_back();
    address.size = each->ai_addrlen;
    std::memcpy(&address.storage, each->ai_addr, each->ai_addrlen);
  }
  return found;
}

bool NameLookup::begin() {
  if (found_) return true;
  auto found = std::make_shared<Found>(look_up(host_, port_, socket_type_, AI_NUMERICHOST));
  if (found->code == EAI_NONAME) {
    const bool begun =
        errand_.begin([found, host = host_, port = port_, socket_type = socket_type_] {
          *found = look_up(host, port, socket_type, 0);
        });
    if (!begun) return false;
  }
  found_ = std::move(found);
  return true;
}

std::vector<HostAddress> NameLookup::take(std::string* error) {
  // The caller may only have waited for the descriptor, which orders no memory: this does.
  static_cast<void>(errand_.is_over());
  const std::shared_ptr<Found> found = std::exchange(found_, nullptr);
  if (found->code != 0) {
    *error = std::string("the host is not found: ") + ::gai_strerror(found->code);
  }
  return std::move(found->addresses);
}

}  // namespace alidade

#pragma once
// UDP ports for RTP and RTCP of a test. What the kernel would hand out, another program may be handed before the test binds it.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace alidade::test {

class UdpPortBlock {
 public:
  // Below those that the kernel hands out.
  static constexpr int kFirst = 20000;
  static constexpr int kPorts = 128;
  static constexpr int kBlocks = 99;

  UdpPortBlock() {
    for (int i = 0; i < kBlocks; ++i) {
      const int block = (static_cast<int>(::getpid()) + i) % kBlocks;
      if (!claim(block)) continue;
      first_ = kFirst + block * kPorts;
      return;
    }
    throw std::runtime_error("every block of UDP ports is taken");
  }
  ~UdpPortBlock() { ::close(claim_); }
  UdpPortBlock(const UdpPortBlock&) = delete;
  UdpPortBlock& operator=(const UdpPortBlock&) = delete;

  // An even port that is free, and the one after it, too; each time another.
  int pair() {
    for (int i = 0; i < kPorts; i += 2) {
      const int port = first_ + next_;
      next_ = (next_ + 2) % kPorts;
      if (is_free(port) && is_free(port + 1)) return port;
    }
    throw std::runtime_error("every UDP port of the block is taken");
  }

  static bool is_free(int port) {
    const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool free = ::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    ::close(fd);
    return free;
  }

 private:
  // By a name that only one living process can have.
  bool claim(int block) {
    claim_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    const std::string text = "alidade-test-udp-ports-" + std::to_string(block);
    std::memcpy(name.sun_path + 1, text.data(), text.size());
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
    if (::bind(claim_, reinterpret_cast<sockaddr*>(&name), size) == 0) return true;
    ::close(claim_);
    return false;
  }

  int claim_ = -1;
  int first_ = 0;
  int next_ = 0;
};

inline int udp_port_pair() {
  static UdpPortBlock block;
  return block.pair();
}

}  // namespace alidade::test

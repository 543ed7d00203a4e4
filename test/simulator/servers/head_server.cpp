#include "test/simulator/servers/head_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace alidade {

HeadServer::HeadServer(Link link, std::unique_ptr<SimulatedHead> head)
    : link_(link), head_(std::move(head)) {
  plug();
}

void HeadServer::open_serial() {
  line_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  char path[64];
  if (line_ < 0 || ::grantpt(line_) != 0 || ::unlockpt(line_) != 0 ||
      ::ptsname_r(line_, path, sizeof path) != 0) {
    throw std::runtime_error("no pseudo-terminal");
  }
  other_end_ = ::open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  ::tcgetattr(other_end_, &settings);
  ::cfmakeraw(&settings);
  ::tcsetattr(other_end_, TCSANOW, &settings);
  address_ = directory_.path() + "/head";
  std::filesystem::create_symlink(path, address_);
}

void HeadServer::open_socket() {
  const bool tcp = link_ == Link::kTcp;
  const int fd = ::socket(AF_INET, (tcp ? SOCK_STREAM : SOCK_DGRAM) | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port_));
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (::bind(fd, generic, size) != 0 || ::getsockname(fd, generic, &size) != 0 ||
      (tcp && ::listen(fd, 16) != 0)) {
    throw std::runtime_error("no socket");
  }
  port_ = ntohs(address.sin_port);
  address_ = (tcp ? "tcp://127.0.0.1:" : "udp://127.0.0.1:") + std::to_string(port_);
  (tcp ? listener_ : line_) = fd;
}

void HeadServer::plug() {
  wake_ = ::eventfd(0, EFD_CLOEXEC);
  link_ == Link::kSerial ? open_serial() : open_socket();
  head_->power_on();
  held_.clear();
  thread_ = std::thread([this] { serve(); });
}

void HeadServer::unplug() {
  if (!thread_.joinable()) {
    return;
  }
  static_cast<void>(::eventfd_write(wake_, 1));
  thread_.join();
  if (link_ == Link::kSerial) {
    std::filesystem::remove(address_);
  }
  for (int* fd : {&line_, &other_end_, &listener_, &wake_}) {
    if (*fd >= 0) {
      ::close(*fd);
    }
    *fd = -1;
  }
}

// False: the plug is pulled.
bool HeadServer::wait(int fd) const {
  std::array<pollfd, 2> waited = {{{wake_, POLLIN, 0}, {fd, POLLIN, 0}}};
  return ::poll(waited.data(), waited.size(), -1) > 0 && waited[0].revents == 0;
}

bool HeadServer::is_pulled(double seconds) const {
  pollfd waited{wake_, POLLIN, 0};
  return ::poll(&waited, 1, static_cast<int>(1e3 * seconds)) > 0;
}

// What came; empty: the master is gone, or the plug is pulled.
std::string HeadServer::receive() {
  if (!wait(line_)) {
    return {};
  }
  char buffer[512];
  sockaddr_in from{};
  socklen_t size = sizeof from;
  auto* generic = reinterpret_cast<sockaddr*>(&from);
  const ssize_t count = link_ == Link::kSerial ? ::read(line_, buffer, sizeof buffer)
                        : link_ == Link::kTcp
                            ? ::recv(line_, buffer, sizeof buffer, 0)
                            : ::recvfrom(line_, buffer, sizeof buffer, 0, generic, &size);
  if (link_ == Link::kUdp) {
    master_.assign(reinterpret_cast<const char*>(&from), size);
  }
  return count > 0 ? std::string(buffer, static_cast<std::size_t>(count)) : std::string();
}

void HeadServer::send(const std::string& bytes) {
  const std::size_t middle = in_two ? bytes.size() / 2 : 0;
  send_piece(bytes.substr(0, middle));
  if (middle > 0 && between_s > 0) {
    static_cast<void>(is_pulled(between_s));
  }
  send_piece(bytes.substr(middle));
}

void HeadServer::send_piece(const std::string& bytes) {
  if (bytes.empty()) {
    return;
  }
  if (link_ == Link::kSerial) {
    static_cast<void>(!::write(line_, bytes.data(), bytes.size()));
  } else if (link_ == Link::kTcp) {
    static_cast<void>(::send(line_, bytes.data(), bytes.size(), MSG_NOSIGNAL));
  } else {
    static_cast<void>(::sendto(line_, bytes.data(), bytes.size(), MSG_NOSIGNAL,
                               reinterpret_cast<const sockaddr*>(master_.data()),
                               static_cast<socklen_t>(master_.size())));
  }
}

std::string HeadServer::noise() {
  std::string bytes(1 + random_() % 8, '\0');
  for (char& c : bytes) {
    c = static_cast<char>(random_() % 2 == 0 ? 0xFFU : random_());
  }
  return bytes;
}

void HeadServer::answer(const std::string& reply) {
  static_cast<void>(is_pulled(answer_s));
  const LineFault now = fault;
  const bool always = now == LineFault::kSilence || now == LineFault::kBabble ||
                      now == LineFault::kRepeated || now == LineFault::kUnsolicited;
  if (now == LineFault::kNone || (!always && random_() % 4 != 0)) {
    send(held_ + reply);
    held_.clear();
    return;
  }
  ++faults;
  std::string damaged = reply;
  const std::size_t place = random_() % reply.size();
  switch (now) {
    case LineFault::kNone:
      break;
    case LineFault::kNoise:
      send(noise());
      send(reply);
      break;
    case LineFault::kLostByte:
      send(damaged.erase(place, 1));
      break;
    case LineFault::kChangedByte:
      damaged[place] = static_cast<char>(damaged[place] ^ static_cast<char>(1 + random_() % 255));
      send(damaged);
      break;
    case LineFault::kMerged:
      held_ += reply;
      break;
    case LineFault::kRepeated:
      send(reply);
      send(reply);
      break;
    case LineFault::kUnsolicited:
      send(head_->unsolicited());
      send(reply);
      break;
    case LineFault::kLate:
      static_cast<void>(is_pulled(late_s));
      send(reply);
      break;
    case LineFault::kSilence:
      break;
    case LineFault::kBabble:
      send(noise());
      break;
  }
}

void HeadServer::serve() {
  for (;;) {
    if (link_ == Link::kTcp) {
      if (!wait(listener_)) {
        return;
      }
      line_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      const int on = nagle ? 0 : 1;
      ::setsockopt(line_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
    for (std::string bytes = receive(); !bytes.empty(); bytes = receive()) {
      for (const std::string& reply : head_->take(bytes)) {
        ++queries;
        answer(reply);
      }
    }
    if (link_ != Link::kTcp || is_pulled(0)) {
      return;
    }
    ::close(line_);
    line_ = -1;
  }
}

}  // namespace alidade

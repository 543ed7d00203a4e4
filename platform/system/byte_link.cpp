#include "platform/system/byte_link.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "platform/system/clock.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

constexpr std::size_t kChunk = 512;  // bytes
constexpr double kBitsPerByte = 10;  // start bit, 8 data bits, stop bit

struct Speed {
  int baud;
  speed_t code;
};
constexpr std::array<Speed, 8> kSpeeds = {{{1200, B1200},
                                           {2400, B2400},
                                           {4800, B4800},
                                           {9600, B9600},
                                           {19200, B19200},
                                           {38400, B38400},
                                           {57600, B57600},
                                           {115200, B115200}}};

// B0 if there is no such speed.
speed_t speed_code(int baud) {
  for (const Speed& speed : kSpeeds) {
    if (speed.baud == baud) {
      return speed.code;
    }
  }
  return B0;
}

// The system's text for an error number.
std::string reason(int error) {
  char buffer[128];
  return ::strerror_r(error, buffer, sizeof buffer);
}

// The same for a serial line, which gives EIO or ENXIO once its plug is pulled.
std::string line_reason(int error) {
  return error == EIO || error == ENXIO ? "the line is gone: unplugged?" : reason(error);
}

bool is_device(const std::string& address) { return address.find("://") == std::string::npos; }

// On false url->shown is what can be shown.
bool parse_link_url(const std::string& text, Url* url) {
  std::string error;
  return parse_url(text, url, &error) && (url->scheme == "tcp" || url->scheme == "udp") &&
         !url->host.empty() && !url->port.empty() && (url->path.empty() || url->path == "/") &&
         url->user.empty() && url->password.empty();
}

}  // namespace

bool is_byte_link_url(const std::string& text) {
  Url url;
  return parse_link_url(text, &url);
}

double wire_time_of_byte_s(const ByteLinkOptions& options) {
  return is_device(options.address) ? kBitsPerByte / options.baud : 0;
}

bool is_baud(int baud) { return speed_code(baud) != B0; }

ByteLink::ByteLink(const ByteLinkOptions& options)
    : options_(options), stop_(::eventfd(0, EFD_CLOEXEC)) {
  const std::string& address = options_.address;
  if (!stop_.is_open()) {
    error_ = "no event descriptor: " + reason(errno);
    return;
  }
  if (is_device(address)) {
    if (address.empty()) {
      error_ = "no device is given; expected a path or tcp://host:port or udp://host:port";
    } else if (!is_baud(options_.baud)) {
      error_ = std::to_string(options_.baud) +
               " baud is not a speed of a serial line; expected 1200, 2400, ... 115200";
    } else {
      kind_ = Kind::kSerial;
    }
    return;
  }
  Url url;
  const bool is_url = parse_link_url(address, &url);
  if (!is_url) {
    options_.address = url.shown;
    error_ = "expected a path such as /dev/ttyUSB0, or tcp://host:port, or udp://host:port";
    return;
  }
  kind_ = url.scheme == "tcp" ? Kind::kTcp : Kind::kUdp;
  const bool is_bracketed = url.host.front() == '[' && url.host.back() == ']';
  host_.emplace(is_bracketed ? url.host.substr(1, url.host.size() - 2) : url.host, url.port,
                kind_ == Kind::kTcp ? SOCK_STREAM : SOCK_DGRAM);
}

void ByteLink::stop() {
  if (stop_.is_open()) {
    static_cast<void>(::eventfd_write(stop_.get(), 1));
  }
}

LinkStatus ByteLink::lost(const std::string& error) {
  error_ = error;
  close();
  return LinkStatus::kLost;
}

LinkStatus ByteLink::open() {
  close();
  switch (kind_) {
    case Kind::kSerial:
      return open_serial();
    case Kind::kTcp:
    case Kind::kUdp:
      return host_->begin() ? LinkStatus::kOk : lost("there can be no thread to look up the host");
    case Kind::kNone:
      break;
  }
  return LinkStatus::kUnusable;
}

LinkStatus ByteLink::open_serial() {
  line_.reset(::open(options_.address.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line_.is_open()) {
    // All of these may pass: a device is plugged in first and gets its permissions a moment later.
    const int code = errno;
    return lost(reason(code) + (code == ENOENT || code == ENXIO ? "; is it plugged in?"
                                : code == EACCES
                                    ? "; add the user to the group of the device (dialout)"
                                    : ""));
  }
  termios line{};
  if (::tcgetattr(line_.get(), &line) != 0) {
    const int code = errno;
    if (code != ENOTTY && code != EINVAL) {
      return lost(line_reason(code));
    }
    static_cast<void>(lost("is not a serial line; expected one such as /dev/ttyUSB0"));
    return LinkStatus::kUnusable;
  }
  if (::flock(line_.get(), LOCK_EX | LOCK_NB) != 0) {
    return lost("is in use by another program; end that one first");
  }
  const speed_t speed = speed_code(options_.baud);
  ::cfmakeraw(&line);  // 8 bits, no parity, nothing translated
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~(static_cast<tcflag_t>(CSTOPB) | static_cast<tcflag_t>(CRTSCTS));
  line.c_cc[VMIN] = 1;  // an empty read is then EAGAIN, and 0 is the end of the line
  line.c_cc[VTIME] = 0;
  termios taken{};
  if (::cfsetspeed(&line, speed) != 0 || ::tcsetattr(line_.get(), TCSANOW, &line) != 0 ||
      ::tcgetattr(line_.get(), &taken) != 0) {
    return lost("does not take its settings: " + line_reason(errno));
  }
  // tcsetattr() succeeds even if only a part was done.
  if (::cfgetospeed(&taken) != speed) {
    static_cast<void>(lost("does not take " + std::to_string(options_.baud) + " baud"));
    return LinkStatus::kUnusable;
  }
  static_cast<void>(::tcflush(line_.get(), TCIOFLUSH));
  return LinkStatus::kOk;
}

// A host may have several addresses: each try takes the next.
LinkStatus ByteLink::connect_socket() {
  std::string error;
  const std::vector<HostAddress> found = host_->take(&error);
  if (found.empty()) {
    return lost(error);
  }
  const HostAddress& chosen = found[tries_++ % found.size()];
  const int type = kind_ == Kind::kTcp ? SOCK_STREAM : SOCK_DGRAM;
  line_.reset(::socket(chosen.family(), type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!line_.is_open()) {
    return lost(reason(errno));
  }
  const int on = 1;
  if (kind_ == Kind::kTcp) {
    static_cast<void>(::setsockopt(line_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on));
  }
  if (::connect(line_.get(), chosen.get(), chosen.size) != 0 && errno != EINPROGRESS) {
    return lost(reason(errno));
  }
  return LinkStatus::kOk;
}

LinkStatus ByteLink::finish_open(double timeout_s) {
  if (kind_ != Kind::kTcp && kind_ != Kind::kUdp) {
    return LinkStatus::kOk;
  }
  const double deadline_s = monotonic_now_s() + timeout_s;
  if (!line_.is_open()) {
    error_ = kNameNotLookedUp;
    if (!host_->is_over()) {
      const LinkStatus status = wait(host_->descriptor(), POLLIN, timeout_s);
      if (status != LinkStatus::kOk) {
        return status;
      }
    }
    const LinkStatus status = connect_socket();
    if (status != LinkStatus::kOk || kind_ == Kind::kUdp) {
      return status;
    }
  }
  error_ = "no connection in time; is the host there?";
  const LinkStatus status = wait(line_.get(), POLLOUT, deadline_s - monotonic_now_s());
  if (status != LinkStatus::kOk) {
    return status;
  }
  int code = 0;
  socklen_t size = sizeof code;
  if (::getsockopt(line_.get(), SOL_SOCKET, SO_ERROR, &code, &size) != 0 || code != 0) {
    return lost(reason(code));
  }
  return LinkStatus::kOk;
}

LinkStatus ByteLink::wait(int descriptor, short events, double timeout_s) {
  std::array<pollfd, 2> waited = {{{stop_.get(), POLLIN, 0}, {descriptor, events, 0}}};
  const int ready = ::poll(waited.data(), waited.size(), poll_milliseconds(timeout_s));
  if (ready > 0 && waited[0].revents != 0) {
    return LinkStatus::kStopped;
  }
  return ready > 0 ? LinkStatus::kOk : LinkStatus::kTimeout;
}

LinkStatus ByteLink::send(std::string_view bytes) {
  const ssize_t sent = kind_ == Kind::kSerial
                           ? ::write(line_.get(), bytes.data(), bytes.size())
                           : ::send(line_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN) {
    return lost(reason(errno));
  }
  if (sent != static_cast<ssize_t>(bytes.size())) {
    return lost("takes no more bytes: the device does not read them");
  }
  return LinkStatus::kOk;
}

LinkStatus ByteLink::receive(std::string* bytes, double timeout_s) {
  bytes->clear();
  const LinkStatus status = wait(line_.get(), POLLIN, timeout_s);
  if (status != LinkStatus::kOk) {
    return status;
  }
  char buffer[kChunk];
  const ssize_t count = ::read(line_.get(), buffer, sizeof buffer);
  if (count > 0) {
    bytes->assign(buffer, static_cast<std::size_t>(count));
    return LinkStatus::kOk;
  }
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
    return LinkStatus::kTimeout;
  }
  if (count == 0) {
    // An empty datagram is not an end.
    return is_datagram() ? LinkStatus::kTimeout
                         : lost(kind_ == Kind::kSerial ? "the line is gone: unplugged?"
                                                       : "the device closed the connection");
  }
  const int code = errno;
  return lost(kind_ == Kind::kSerial ? line_reason(code) : reason(code));
}

}  // namespace alidade

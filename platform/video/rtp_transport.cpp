#include "platform/video/rtp_transport.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <optional>
#include <thread>

#include "platform/system/clock.h"
#include "platform/system/shown.h"
#include "platform/video/rtp_packet.h"
#include "platform/video/session_description.h"

namespace alidade {
namespace {

constexpr int kSocketBuffer = 4 << 20;  // bytes: several pictures
constexpr double kSlice_s = 0.1;        // of a wait: longest delay of an interruption

// A numeric address as the socket interface takes it, IPv4 or IPv6.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

// The address of a pair of ports.
struct Listening {
  SocketAddress address;  // with port 0
  bool is_group = false;  // multicast
};

// Text that is not a numeric address gives IPv4, any.
SocketAddress numeric(const std::string& address) {
  SocketAddress out;
  sockaddr_in ipv4{};
  sockaddr_in6 ipv6{};
  if (::inet_pton(AF_INET6, address.c_str(), &ipv6.sin6_addr) == 1) {
    ipv6.sin6_family = AF_INET6;
    std::memcpy(&out.storage, &ipv6, out.size = sizeof ipv6);
    return out;
  }
  ipv4.sin_family = AF_INET;
  (void)::inet_pton(AF_INET, address.c_str(), &ipv4.sin_addr);
  std::memcpy(&out.storage, &ipv4, out.size = sizeof ipv4);
  return out;
}

bool is_multicast(const SocketAddress& address) {
  if (address.storage.ss_family == AF_INET6) {
    return IN6_IS_ADDR_MULTICAST(
        &reinterpret_cast<const sockaddr_in6*>(&address.storage)->sin6_addr);
  }
  return IN_MULTICAST(
      ntohl(reinterpret_cast<const sockaddr_in*>(&address.storage)->sin_addr.s_addr));
}

// A sender's address only selects IPv4 or IPv6.
Listening listening_to(const std::string& address) {
  const SocketAddress told = numeric(address);
  if (is_multicast(told)) return {told, true};
  return {numeric(told.storage.ss_family == AF_INET6 ? "::" : "0.0.0.0"), false};
}

SocketAddress with_port(SocketAddress address, int port) {
  const in_port_t network = htons(static_cast<std::uint16_t>(port));
  if (address.storage.ss_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6*>(&address.storage)->sin6_port = network;
  } else {
    reinterpret_cast<sockaddr_in*>(&address.storage)->sin_port = network;
  }
  return address;
}

template <class Value>
bool set(const FileDescriptor& socket, int level, int name, const Value& value) {
  return ::setsockopt(socket.get(), level, name, &value, sizeof value) == 0;
}

// If the senders are known, joins for them only (RFC 4607): some networks forward a group's packets
// only then.
bool join(const FileDescriptor& socket, const SocketAddress& group, const UdpSenders& senders) {
  const int level = group.storage.ss_family == AF_INET6 ? IPPROTO_IPV6 : IPPROTO_IP;
  for (const std::string& sender : senders.names()) {
    group_source_req request{};
    request.gsr_group = group.storage;
    request.gsr_source = numeric(sender).storage;
    if (!set(socket, level, MCAST_JOIN_SOURCE_GROUP, request)) return false;
  }
  if (!senders.empty()) return true;
  group_req request{};
  request.gr_group = group.storage;
  return set(socket, level, MCAST_JOIN_GROUP, request);
}

// A closed one on failure; errno says why.
FileDescriptor open_socket(const Listening& to, int port, const UdpSenders& senders) {
  const int family = to.address.storage.ss_family;
  FileDescriptor socket(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.is_open()) return socket;
  // A smaller buffer, and packets without a kernel time, will do.
  (void)set(socket, SOL_SOCKET, SO_RCVBUF, kSocketBuffer);
  (void)set(socket, SOL_SOCKET, SO_TIMESTAMPNS, 1);
  // A group may have several listeners on a host. A socket must not receive other groups on the
  // same port.
  const SocketAddress bound = with_port(to.address, port);
  const bool works = (!to.is_group || set(socket, SOL_SOCKET, SO_REUSEADDR, 1)) &&
                     (family != AF_INET6 || set(socket, IPPROTO_IPV6, IPV6_V6ONLY, 1)) &&
                     ::bind(socket.get(), bound.get(), bound.size) == 0 &&
                     (!to.is_group || join(socket, to.address, senders));
  if (!works) socket.reset();
  return socket;
}

double seconds(const timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The kernel's stamp is in UTC, which may have been set since. The time between reading the two
// clocks makes a packet seem late, never early.
double age_of(msghdr* message) {
  for (cmsghdr* item = CMSG_FIRSTHDR(message); item != nullptr; item = CMSG_NXTHDR(message, item)) {
    if (item->cmsg_level != SOL_SOCKET || item->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(item), sizeof stamp);
    return std::max(0.0, utc_now_s() - seconds(stamp));
  }
  return 0;
}

}  // namespace

ReadStatus RtpPorts::open(const std::string& address, int port, const UdpSenders& senders,
                          std::string* error, SenderChoice* choice) {
  const Listening to = listening_to(address);
  senders_ = senders;
  choice_ = choice;
  for (int i = 0; i < 2; ++i) {
    Socket& socket = sockets_[static_cast<std::size_t>(i)];
    socket = {open_socket(to, port + i, senders), monotonic_now_s()};
    if (socket.descriptor.is_open()) continue;
    *error = "cannot listen on the UDP ports " + std::to_string(port) + " and " +
             std::to_string(port + 1) + " (" + std::strerror(errno) + "); does another program?";
    return ReadStatus::kDisconnected;
  }
  return ReadStatus::kOk;
}

// The next waiting packet. kTimeout: there is none, or it is from another sender.
ReadStatus RtpPorts::take(Socket* socket, std::uint8_t* data, std::size_t capacity,
                          ReceivedPacket* packet, std::string* error) {
  iovec place{data, capacity};
  alignas(cmsghdr) std::array<std::uint8_t, CMSG_SPACE(sizeof(timespec))> control{};
  msghdr message{};
  sockaddr_storage from{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const double before_s = monotonic_now_s();
  const ssize_t size = ::recvmsg(socket->descriptor.get(), &message, 0);
  const auto bytes = static_cast<std::size_t>(std::max<ssize_t>(size, 0));
  if (size > 0 && senders_.take(from) &&
      (choice_ == nullptr || choice_->take(from, data, bytes, before_s))) {
    const double age_s = age_of(&message);
    const double now_s = monotonic_now_s();
    packet->size = bytes;
    packet->arrival_s = std::max(socket->not_before_s, now_s - age_s);
    socket->not_before_s = packet->arrival_s;
    return ReadStatus::kOk;
  }
  if (size < 0 && errno == EAGAIN) socket->not_before_s = before_s;
  if (size >= 0 || errno == EAGAIN || errno == EINTR) return ReadStatus::kTimeout;
  *error = std::strerror(errno);
  return ReadStatus::kDisconnected;
}

ReadStatus RtpPorts::receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                             ReceivedPacket* packet, std::string* error) {
  auto& [media, reports] = sockets_;
  while (!interrupted_) {
    // Between pictures a report goes first. Those that wait have their UTC by it: behind them it
    // would come too late.
    ReadStatus status =
        amid_picture_ ? ReadStatus::kTimeout : take(&reports, data, capacity, packet, error);
    if (status == ReadStatus::kTimeout) {
      status = take(&media, data, capacity, packet, error);
      if (status == ReadStatus::kOk) {
        const std::optional<RtpHeader> header = parse_rtp_header(data, packet->size);
        amid_picture_ = header && !header->marker;
      }
    }
    if (status != ReadStatus::kTimeout) return status;
    const double left_s = deadline_s - monotonic_now_s();
    if (!(left_s > 0)) return ReadStatus::kTimeout;
    if (std::exchange(amid_picture_, false)) {
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, kGather_s)));
      continue;
    }
    std::array<pollfd, 2> waiting{pollfd{media.descriptor.get(), POLLIN, 0},
                                  pollfd{reports.descriptor.get(), POLLIN, 0}};
    const double wait_ms = 1e3 * std::min(left_s, kSlice_s);
    (void)::poll(waiting.data(), waiting.size(), static_cast<int>(std::ceil(wait_ms)));
  }
  return ReadStatus::kStopped;
}

ReadStatus UdpTransport::open(double /*deadline_s*/, std::string* sdp, std::string* error) {
  *sdp = sdp_;
  const std::optional<VideoDescription> video = find_video(sdp_);
  if (!video) {
    *error = "there is no video in this stream";
    return ReadStatus::kFailed;
  }
  if (video->port == 0) {
    *error = "the session description names no port, as for RTSP; give the rtsp:// URL";
    return ReadStatus::kFailed;
  }
  UdpSenders senders;
  for (const std::string& sender : video->senders) {
    if (senders.add(sender)) continue;
    *error = "the session description's source-filter names '" + shown(sender) +
             "'; write the sender's numeric address";
    return ReadStatus::kFailed;
  }
  choice_.begin(video->payload_type, video->source, senders.empty(), monotonic_now_s());
  return ports_.open(video->address, video->port, senders, error, &choice_);
}

ReadStatus UdpTransport::receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                 ReceivedPacket* packet, std::string* error) {
  if (choice_.trial_is_over(monotonic_now_s(), error)) return ReadStatus::kDisconnected;
  return ports_.receive(deadline_s, data, capacity, packet, error);
}

}  // namespace alidade

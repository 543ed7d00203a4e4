#include "test/platform/support/rtp_relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <stdexcept>

#include "test/platform/support/rtp_sender.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int bound_socket(int port) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(port);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("no UDP port");
  }
  return fd;
}

void append(RtpRelay::Packet* packet, std::uint32_t word) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    packet->push_back(static_cast<std::uint8_t>(word >> shift));
  }
}

std::uint32_t timestamp_of(const RtpRelay::Packet& packet) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i < 8; ++i) value = value << 8U | packet[i];
  return value;
}

}  // namespace

RtpRelay::RtpRelay(int to_port) : port_(test::udp_port_pair()), to_port_(to_port) {
  fd_ = bound_socket(port_);
  rtcp_fd_ = bound_socket(port_ + 1);
}

RtpRelay::~RtpRelay() {
  ::close(fd_);
  ::close(rtcp_fd_);
}

void RtpRelay::forward(const std::function<void(Packets&)>& change) {
  Packets packets;
  std::uint8_t buffer[65'536];
  for (;;) {
    const ssize_t size = ::recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT);
    if (size < 0) break;
    const Packet packet(buffer, buffer + size);
    if (!shift_) shift_ = first_ ? *first_ - timestamp_of(packet) : 0;
    packets.emplace_back(packet.begin(), packet.begin() + 4);
    append(&packets.back(), timestamp_of(packet) + *shift_);
    packets.back().insert(packets.back().end(), packet.begin() + 8, packet.end());
  }
  change(packets);
  const sockaddr_in address = loopback(to_port_);
  for (const Packet& packet : packets) {
    (void)::sendto(fd_, packet.data(), packet.size(), 0,
                   reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
}

void RtpRelay::report(std::uint64_t ntp, std::uint32_t timestamp) {
  Packet packet = {0x80, 200, 0, 6, 0, 0, 0, 7};
  append(&packet, static_cast<std::uint32_t>(ntp >> 32U));
  append(&packet, static_cast<std::uint32_t>(ntp));
  for (const std::uint32_t word : {timestamp, 1U, 1U}) append(&packet, word);
  const sockaddr_in address = loopback(to_port_ + 1);
  (void)::sendto(rtcp_fd_, packet.data(), packet.size(), 0,
                 reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

RtpRelay::Packet with_capture_time(const RtpRelay::Packet& packet, double utc_s) {
  const auto seconds = static_cast<std::uint32_t>(std::floor(utc_s) + 2'208'988'800.0);
  const auto sixteenths = static_cast<std::uint32_t>(16 * (utc_s - std::floor(utc_s)));
  RtpRelay::Packet changed(packet.begin(), packet.begin() + 12);
  changed[0] |= 0x10U;
  for (const std::uint32_t word : {0xABAC'0003U, seconds, sixteenths << 28U, 0U}) {
    append(&changed, word);
  }
  changed.insert(changed.end(), packet.begin() + 12, packet.end());
  return changed;
}

}  // namespace alidade

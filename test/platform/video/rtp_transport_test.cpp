#include "platform/video/rtp_transport.h"

#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr double kLong_s = 20;  // far beyond what any event here takes

// size: 12 or more.
Bytes rtp(bool last, std::size_t size = 64) {
  Bytes out(size, 0x5a);
  out[0] = 0x80;
  out[1] = static_cast<std::uint8_t>(26 | (last ? 0x80 : 0));
  return out;
}

void send_to(const std::string& address, int port, const Bytes& packet) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* to = nullptr;
  ASSERT_EQ(::getaddrinfo(address.c_str(), std::to_string(port).c_str(), &hints, &to), 0);
  const FileDescriptor socket(::socket(to->ai_family, SOCK_DGRAM, 0));
  const ssize_t sent =
      ::sendto(socket.get(), packet.data(), packet.size(), 0, to->ai_addr, to->ai_addrlen);
  ::freeaddrinfo(to);
  ASSERT_EQ(sent, static_cast<ssize_t>(packet.size()));
}

class RtpPortsTest : public ::testing::Test {
 protected:
  ReadStatus open(const std::string& address) {
    return ports_.open(address, port_, senders_, &error_);
  }
  ReadStatus receive(double wait_s = kLong_s) {
    return ports_.receive(monotonic_now_s() + wait_s, data_.data(), data_.size(), &packet_,
                          &error_);
  }
  [[nodiscard]] Bytes received() const {
    return {data_.begin(), data_.begin() + static_cast<std::ptrdiff_t>(packet_.size)};
  }

  int port_ = test::udp_port_pair();
  RtpPorts ports_;
  UdpSenders senders_;
  ReceivedPacket packet_;
  std::string error_;
  std::array<std::uint8_t, 65'536> data_{};
};

TEST_F(RtpPortsTest, GivesThePacketsOfBothPortsWhole) {
  ASSERT_EQ(open("0.0.0.0"), ReadStatus::kOk) << error_;
  const std::vector<Bytes> sent = {{0x80}, rtp(false, 12), rtp(true, 60'000), rtp(false, 1400)};
  for (const Bytes& packet : sent) send_to("127.0.0.1", port_, packet);
  for (const Bytes& packet : sent) {
    ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
    EXPECT_EQ(received(), packet);
  }
  const Bytes report(28, 0x81);
  send_to("127.0.0.1", port_ + 1, report);
  ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
  EXPECT_EQ(received(), report);
  EXPECT_EQ(receive(0.01), ReadStatus::kTimeout);
  EXPECT_EQ(receive(-1), ReadStatus::kTimeout);
}

TEST_F(RtpPortsTest, AnEmptyPacketIsNone) {
  ASSERT_EQ(open("0.0.0.0"), ReadStatus::kOk) << error_;
  send_to("127.0.0.1", port_, {});
  send_to("127.0.0.1", port_, rtp(true));
  ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
  EXPECT_EQ(received(), rtp(true));
}

// A process that was stopped, or had no processor, reads late what came in time.
TEST_F(RtpPortsTest, APacketIsAsOldAsItsArrival) {
  constexpr double kLate_s = 0.4;
  ASSERT_EQ(open("0.0.0.0"), ReadStatus::kOk) << error_;
  const double begin_s = monotonic_now_s();
  // The kernel begins to stamp some time after the first socket of the machine asks for it.
  for (bool stamped = false; !stamped;) {
    const double before_s = monotonic_now_s();
    send_to("127.0.0.1", port_, rtp(true));
    const double sent_s = monotonic_now_s();
    std::this_thread::sleep_for(std::chrono::duration<double>(kLate_s));
    ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
    stamped = packet_.arrival_s < sent_s + kLate_s / 2;
    ASSERT_TRUE(stamped || before_s < begin_s + kLong_s);
    // The kernel's UTC and CLOCK_MONOTONIC are read one after the other.
    EXPECT_GT(packet_.arrival_s, before_s - kLate_s / 2);
    EXPECT_LE(packet_.arrival_s, monotonic_now_s());
  }
}

TEST_F(RtpPortsTest, NoPacketIsOlderThanTheOneBeforeOrThanASocketFoundEmpty) {
  ASSERT_EQ(open("0.0.0.0"), ReadStatus::kOk) << error_;
  double last_s = monotonic_now_s();
  for (int i = 0; i < 300; ++i) {
    if (i % 30 == 0) {
      last_s = monotonic_now_s();
      ASSERT_EQ(receive(0), ReadStatus::kTimeout);
    }
    send_to("127.0.0.1", port_, rtp(i % 10 == 9));
    if (i % 2 == 0) continue;
    for (int waiting = 0; waiting < 2; ++waiting) {
      ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
      EXPECT_GE(packet_.arrival_s, last_s) << i;
      last_s = packet_.arrival_s;
    }
    EXPECT_LE(last_s, monotonic_now_s());
  }
}

TEST_F(RtpPortsTest, HearsIpv6) {
  const FileDescriptor socket(::socket(AF_INET6, SOCK_DGRAM, 0));
  sockaddr_in6 loopback{};
  loopback.sin6_family = AF_INET6;
  loopback.sin6_addr = in6addr_loopback;
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&loopback), sizeof loopback) != 0) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  ASSERT_EQ(open("fe80::1"), ReadStatus::kOk) << error_;
  send_to("::1", port_, rtp(true));
  ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
  EXPECT_EQ(received(), rtp(true));
}

TEST_F(RtpPortsTest, AGroupHasSeveralListenersThatHearNoOtherGroup) {
  const std::string group = "239.255.77.1";
  if (open(group) != ReadStatus::kOk) GTEST_SKIP() << "no multicast here: " << error_;
  RtpPorts second;
  ASSERT_EQ(second.open(group, port_, senders_, &error_), ReadStatus::kOk) << error_;
  RtpPorts other;
  ASSERT_EQ(other.open("239.255.77.2", port_, senders_, &error_), ReadStatus::kOk) << error_;
  send_to(group, port_, rtp(true));
  ASSERT_EQ(receive(), ReadStatus::kOk) << error_;
  EXPECT_EQ(received(), rtp(true));
  const auto receive_by = [&](RtpPorts* ports, double wait_s) {
    return ports->receive(monotonic_now_s() + wait_s, data_.data(), data_.size(), &packet_,
                          &error_);
  };
  EXPECT_EQ(receive_by(&second, kLong_s), ReadStatus::kOk);
  EXPECT_EQ(receive_by(&other, 0.01), ReadStatus::kTimeout);
}

TEST_F(RtpPortsTest, SaysThatAPortIsTaken) {
  RtpPorts first;
  ASSERT_EQ(first.open("0.0.0.0", port_ + 1, senders_, &error_), ReadStatus::kOk) << error_;
  EXPECT_EQ(open("0.0.0.0"), ReadStatus::kDisconnected);
  EXPECT_EQ(error_, "cannot listen on the UDP ports " + std::to_string(port_) + " and " +
                        std::to_string(port_ + 1) +
                        " (Address already in use); does another program?");
}

TEST_F(RtpPortsTest, AnInterruptionEndsAWaitForGood) {
  ASSERT_EQ(open("0.0.0.0"), ReadStatus::kOk) << error_;
  std::thread other([&] { ports_.interrupt(); });
  EXPECT_EQ(receive(), ReadStatus::kStopped);
  other.join();
  EXPECT_EQ(receive(), ReadStatus::kStopped);
}

}  // namespace
}  // namespace alidade

// Several senders of plain RTP to one port: one of them is the video.

#include "platform/video/sender_choice.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <array>
#include <memory>
#include <string>

#include "platform/video/rtp_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/rtp_sender.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

constexpr double kPatience_s = 3;
constexpr int kPayloadType = 96;
constexpr std::uint32_t kSource = 0x11223344;

sockaddr_storage of_ipv4(const std::string& address) {
  sockaddr_storage storage{};
  auto* ipv4 = reinterpret_cast<sockaddr_in*>(&storage);
  ipv4->sin_family = AF_INET;
  EXPECT_EQ(::inet_pton(AF_INET, address.c_str(), &ipv4->sin_addr), 1);
  return storage;
}

class SenderChoiceTest : public ::testing::Test {
 protected:
  SenderChoiceTest() { begin(0); }

  void begin(double now_s) { choice_.begin(kPayloadType, std::nullopt, true, now_s); }
  bool take(const std::string& from, double now_s, std::uint32_t source = kSource,
            int payload_type = kPayloadType) {
    std::array<std::uint8_t, 12> packet{0x80, static_cast<std::uint8_t>(payload_type)};
    for (int i = 0; i < 4; ++i) {
      packet[static_cast<std::size_t>(8 + i)] = static_cast<std::uint8_t>(source >> (24 - 8 * i));
    }
    return choice_.take(of_ipv4(from), packet.data(), packet.size(), now_s);
  }

  SenderChoice choice_{kPatience_s};
  std::string error_;
};

TEST_F(SenderChoiceTest, FollowsTheFirst) {
  EXPECT_TRUE(take("192.0.2.1", 1));
  EXPECT_FALSE(take("192.0.2.2", 1));
  EXPECT_FALSE(take("192.0.2.1", 1, kSource + 1));
  EXPECT_TRUE(take("192.0.2.1", 2));
  EXPECT_EQ(choice_.foreign(), 2);
  EXPECT_THAT(choice_.foreign_kind(), HasSubstr("192.0.2.2, SSRC 11223344"));
}

// Sound or metadata may come first.
TEST_F(SenderChoiceTest, FollowsNobodyForPacketsOfAnotherKind) {
  EXPECT_TRUE(take("192.0.2.2", 1, kSource, 0));
  EXPECT_TRUE(take("192.0.2.1", 1));
  EXPECT_FALSE(take("192.0.2.2", 1, kSource, 0));
  EXPECT_TRUE(take("192.0.2.1", 1, kSource + 1, 0));
}

TEST_F(SenderChoiceTest, TriesOthersInTurnForLongerAndLonger) {
  EXPECT_TRUE(take("192.0.2.1", 1));
  EXPECT_FALSE(choice_.trial_is_over(100, &error_));  // nobody else
  EXPECT_FALSE(take("192.0.2.2", 2));
  EXPECT_FALSE(choice_.trial_is_over(1 + kPatience_s, &error_));
  ASSERT_TRUE(choice_.trial_is_over(1.01 + kPatience_s, &error_));
  EXPECT_THAT(error_, HasSubstr("no picture of 192.0.2.1, SSRC 11223344 can be decoded"));
  double now_s = 1.01 + kPatience_s;
  for (const char* next : {"192.0.2.2", "192.0.2.1", "192.0.2.2"}) {
    for (const char* each : {"192.0.2.1", "192.0.2.2"}) (void)take(each, now_s);
    begin(now_s);
    EXPECT_TRUE(take(next, now_s)) << next;
    now_s += 1.01 * kPatience_s;
    for (const char* each : {"192.0.2.1", "192.0.2.2"}) (void)take(each, now_s);
    const bool is_first_trial = std::string(next) == "192.0.2.2" && now_s < 4 * kPatience_s;
    EXPECT_EQ(choice_.trial_is_over(now_s, &error_), is_first_trial) << next << " " << now_s;
    if (is_first_trial) continue;
    now_s += 3 * kPatience_s;
    for (const char* each : {"192.0.2.1", "192.0.2.2"}) (void)take(each, now_s);
    EXPECT_TRUE(choice_.trial_is_over(now_s, &error_)) << next;
  }
}

TEST_F(SenderChoiceTest, KeepsWhoseAPictureWasDecodedUntilItIsSilent) {
  EXPECT_TRUE(take("192.0.2.1", 1));
  choice_.keep(choice_.trial());
  for (double now_s = 2; now_s < 20; ++now_s) {
    EXPECT_TRUE(take("192.0.2.1", now_s));
    EXPECT_TRUE(take("192.0.2.1", now_s, kSource + 1));  // StreamFilter judges
    EXPECT_FALSE(take("192.0.2.2", now_s));
  }
  EXPECT_FALSE(choice_.trial_is_over(20, &error_));
  begin(19 + kPatience_s);
  EXPECT_FALSE(take("192.0.2.2", 20));
  begin(19.01 + kPatience_s);
  EXPECT_TRUE(take("192.0.2.2", 23));
  EXPECT_FALSE(take("192.0.2.1", 23));
}

TEST_F(SenderChoiceTest, KeepsNobodyForAPictureOfAnEarlierConnection) {
  EXPECT_TRUE(take("192.0.2.1", 1));
  const int earlier = choice_.trial();
  begin(1 + 2 * kPatience_s);
  EXPECT_TRUE(take("192.0.2.2", 8));
  choice_.keep(earlier);
  EXPECT_FALSE(take("192.0.2.1", 8));
  (void)take("192.0.2.1", 10);
  EXPECT_TRUE(choice_.trial_is_over(8.01 + kPatience_s, &error_));
}

TEST_F(SenderChoiceTest, TriesOthersOnceTheKeptIsOfNoUse) {
  EXPECT_TRUE(take("192.0.2.1", 1));
  choice_.keep(choice_.trial());
  EXPECT_FALSE(take("192.0.2.2", 1));
  choice_.give_up();
  (void)take("192.0.2.2", 1);
  begin(2);
  EXPECT_TRUE(take("192.0.2.2", 2));
}

TEST_F(SenderChoiceTest, TakesTheNamedSourceOnly) {
  choice_.begin(kPayloadType, kSource, true, 0);
  EXPECT_FALSE(take("192.0.2.2", 1, kSource + 1));
  EXPECT_TRUE(take("192.0.2.1", 1));
  EXPECT_FALSE(take("192.0.2.1", 9, kSource + 1));
  choice_.begin(kPayloadType, kSource, false, 0);
  EXPECT_FALSE(take("192.0.2.1", 1, kSource + 1));
  EXPECT_TRUE(take("192.0.2.2", 1));
}

TEST_F(SenderChoiceTest, KnowsABoundedNumberOfSenders) {
  for (std::uint32_t i = 0; i < 1000; ++i) (void)take("192.0.2.1", 1, i);
  EXPECT_EQ(choice_.foreign(), 999);
  choice_.keep(choice_.trial());
  EXPECT_TRUE(take("192.0.2.1", 1));
}

// To a port, from two addresses; to a group, from one with two SSRCs.
class TwoSenders : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    options_.url = "rtp://" + std::string(GetParam() ? kGroup : "@") + ":" + std::to_string(port_);
    options_.timeout_s = kDeadline_s;
    options_.max_backoff_s = 0.01;
  }
  void listen() {
    source_ = open_rtp(options_);
    bool lost = false;
    ASSERT_TRUE(eventually([&] {
      lost = source_->read(frame_, 0) == ReadStatus::kDisconnected;
      return lost || rtp_port_taken(port_);
    }));
    if (lost) GTEST_SKIP() << "no multicast here: " << source_->error();
  }
  [[nodiscard]] std::string to() const { return GetParam() ? kGroup : "127.0.0.1"; }
  [[nodiscard]] std::string from() const { return GetParam() ? "" : "127.0.0.2"; }

  static constexpr const char* kGroup = "239.255.77.3";
  const int port_ = test::udp_port_pair();
  RtpSourceOptions options_;
  std::unique_ptr<FrameSource> source_;
  Frame frame_;
};

INSTANTIATE_TEST_SUITE_P(, TwoSenders, ::testing::Bool(), [](const auto& which) {
  return std::string(which.param ? "ToAGroup" : "ToAPort");
});

TEST_P(TwoSenders, TheFirstIsKept) {
  listen();
  if (IsSkipped()) return;
  RtpSender sender(RtpSender::Codec::kMjpeg, port_, 1, 1200, "", to());
  RtpSender other(RtpSender::Codec::kMjpeg, port_, 7, 1200, from(), to());
  for (int i = 0; i < 10; ++i) {
    sender.send();
    ASSERT_EQ(read_until(*source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
    EXPECT_NEAR(frame_.luma[0], RtpSender::grey_of(i), 3);
    if (i > 0) other.send();  // of another grey
  }
  EXPECT_GE(source_->counters().foreign_packets, 8);
}

TEST_P(TwoSenders, WhoseFirstSendsNothingThatCanBeDecodedTheOtherIsTaken) {
  options_.timeout_s = 0.3;
  listen();
  if (IsSkipped()) return;
  RtpSender sender(RtpSender::Codec::kMjpeg, port_, 1, 1200, "", to());
  RtpSender other(RtpSender::Codec::kMjpeg, port_, 7, 1200, from(), to());
  other.send(0.9);
  std::string errors;
  const auto taken = [&] {
    other.send(0.9);
    sender.send();
    const ReadStatus status = source_->read(frame_, 0.01);
    if (status == ReadStatus::kDisconnected) errors += source_->error() + "\n";
    return status == ReadStatus::kOk;
  };
  ASSERT_TRUE(eventually(taken)) << errors;
  EXPECT_THAT(errors, HasSubstr("can be decoded; others send, too"));
  EXPECT_EQ(frame_.width, RtpSender::kWidth);
}

TEST_P(TwoSenders, TheOtherIsTakenOnceTheFirstIsSilent) {
  options_.timeout_s = 0.3;
  listen();
  if (IsSkipped()) return;
  RtpSender sender(RtpSender::Codec::kMjpeg, port_, 1, 1200, "", to());
  RtpSender other(RtpSender::Codec::kMjpeg, port_, 7, 1200, from(), to());
  sender.send();
  ASSERT_EQ(read_until(*source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
  const auto taken = [&] {
    other.send();
    return source_->read(frame_, 0.01) == ReadStatus::kOk;
  };
  EXPECT_TRUE(eventually(taken)) << source_->error();
}

}  // namespace
}  // namespace alidade

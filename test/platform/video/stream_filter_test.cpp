#include "platform/video/stream_filter.h"

#include <gtest/gtest.h>

#include <vector>

namespace alidade {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes rtp(int type, std::uint8_t source, std::uint16_t sequence = 0) {
  return {0x80,
          static_cast<std::uint8_t>(type),
          static_cast<std::uint8_t>(sequence >> 8U),
          static_cast<std::uint8_t>(sequence),
          0,
          0,
          0,
          1,
          0,
          0,
          0,
          source};
}

Bytes report(std::uint8_t source) {
  Bytes bytes(28, 0);
  bytes[0] = 0x80;
  bytes[1] = 200;
  bytes[7] = source;
  return bytes;
}

class StreamFilterTest : public ::testing::Test {
 protected:
  bool takes(const Bytes& packet, double at_s = 0) {
    return filter_.takes(packet.data(), packet.size(), at_s);
  }
  std::vector<int> between() const {
    std::vector<int> numbers;
    filter_.for_each_between([&](const RtpHeader& header) { numbers.push_back(header.sequence); });
    return numbers;
  }
  StreamFilter filter_{96};
};

TEST_F(StreamFilterTest, TakesTheTypeThatWasAgreedUpon) {
  EXPECT_TRUE(takes(rtp(96, 1)));
  EXPECT_TRUE(takes(rtp(0x80 | 96, 1)));
  EXPECT_FALSE(takes(rtp(97, 1)));
  EXPECT_EQ(filter_.foreign(), 1);
  EXPECT_EQ(filter_.foreign_kind(), "payload type 97 in place of 96");
  EXPECT_TRUE(takes({1, 2, 3})) << "not judged";
  StreamFilter any;
  const Bytes other = rtp(26, 1);
  EXPECT_TRUE(any.takes(other.data(), other.size(), 0));
}

TEST_F(StreamFilterTest, FollowsASenderThatBeganAnewAtOnce) {
  EXPECT_TRUE(takes(rtp(96, 1), 0));
  EXPECT_TRUE(takes(rtp(96, 2), 0.01));
  EXPECT_TRUE(takes(rtp(96, 2), 0.02));
  EXPECT_TRUE(takes(rtp(96, 3), 9));
  EXPECT_EQ(filter_.foreign(), 0);
}

TEST_F(StreamFilterTest, StaysWithTheFirstOfTwoSenders) {
  EXPECT_TRUE(takes(rtp(96, 1), 0));
  EXPECT_TRUE(takes(rtp(96, 2), 0.01)) << "it may have begun anew";
  for (int i = 1; i < 20; ++i) {
    EXPECT_TRUE(takes(rtp(96, 1), 0.1 * i)) << i;
    EXPECT_FALSE(takes(rtp(96, 2), 0.1 * i + 0.01)) << i;
  }
  EXPECT_EQ(filter_.foreign_kind(), "another sender (SSRC 00000002)");
  EXPECT_FALSE(takes(rtp(96, 2), 2.8));
  EXPECT_TRUE(takes(rtp(96, 2), 3)) << "the first is silent";
  EXPECT_FALSE(takes(rtp(96, 3), 3.1));
}

TEST_F(StreamFilterTest, PrefersTheSourceThatWasAgreedUpon) {
  filter_ = StreamFilter(96, 7);
  EXPECT_TRUE(takes(rtp(96, 1), 0)) << "as long as the other does not come";
  EXPECT_TRUE(takes(rtp(96, 7), 0.1));
  EXPECT_FALSE(takes(rtp(96, 1), 0.2));
  EXPECT_TRUE(takes(rtp(96, 7), 0.3));
}

TEST_F(StreamFilterTest, LeavesOutReportsOfForeignSources) {
  EXPECT_TRUE(takes(report(9))) << "nothing is known of it";
  EXPECT_TRUE(takes(rtp(96, 1)));
  EXPECT_FALSE(takes(rtp(97, 2)));
  EXPECT_FALSE(takes(report(2)));
  EXPECT_TRUE(takes(report(1)));
  EXPECT_TRUE(takes(report(9))) << "some cameras report under another name";
}

TEST_F(StreamFilterTest, TellsWhichForeignOnesWereNumberedWithTheStreamsOwn) {
  EXPECT_TRUE(takes(rtp(96, 1, 65'534)));
  EXPECT_FALSE(takes(rtp(97, 1, 65'535)));
  EXPECT_FALSE(takes(rtp(97, 1, 0)));
  EXPECT_FALSE(takes(rtp(97, 1, 300)));
  EXPECT_FALSE(takes(rtp(97, 2, 1)));
  EXPECT_TRUE(takes(rtp(96, 1, 2)));
  EXPECT_EQ(between(), (std::vector<int>{65'535, 0}));
  EXPECT_TRUE(takes(rtp(96, 1, 3)));
  EXPECT_EQ(between(), std::vector<int>{});
}

}  // namespace
}  // namespace alidade

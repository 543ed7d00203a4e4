#include "platform/video/stream_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace alidade {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes rtp(int type, std::uint8_t source, std::uint16_t sequence = 0, int picture = 1) {
  return {0x80,
          static_cast<std::uint8_t>(type),
          static_cast<std::uint8_t>(sequence >> 8U),
          static_cast<std::uint8_t>(sequence),
          0,
          0,
          0,
          static_cast<std::uint8_t>(picture),
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

// Three packets a picture, 25 a second, from the source that was followed and then from another.
TEST_F(StreamFilterTest, FollowsASenderThatBeganAnewFromItsFirstPacketOn) {
  for (const double pause_s : {0.04, 0.3, 20.0}) {
    filter_ = StreamFilter(96);
    for (std::uint16_t i = 0; i < 30; ++i) EXPECT_TRUE(takes(rtp(96, 1, i, i / 3), 0.04 * (i / 3)));
    std::vector<int> numbers;
    std::uint16_t sent = 0;
    for (; sent < 30; ++sent) {
      const double at_s = 0.36 + pause_s + 0.04 * (sent / 3);
      if (takes(rtp(96, 2, sent, 100 + sent / 3), at_s)) numbers.push_back(sent);
      if (sent == 1) {
        EXPECT_FALSE(takes(report(2), at_s)) << "comes with its packets";
      }
      while (const auto held = filter_.release()) {
        const auto header = parse_rtp_header(held->bytes.data(), held->bytes.size());
        if (header) {
          EXPECT_EQ(header->source, 2U);
          numbers.push_back(header->sequence);
        }
      }
      if (numbers.size() == sent + 1U) break;
    }
    EXPECT_LE(sent, 6) << "within three pictures";
    for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], i);
    EXPECT_EQ(filter_.source(), 2U);
    EXPECT_EQ(filter_.foreign(), 0);
    EXPECT_TRUE(takes(rtp(96, 2, 31, 120), 30));
  }
}

// Whatever the two senders' rates are, nothing of the other is ever among the first one's.
TEST_F(StreamFilterTest, IsNotLedAwayByASecondSender) {
  for (const double own_s : {0.04, 0.067, 1.0, 2.0}) {
    for (const double other_s : {0.005, 0.033, 0.04, 0.2}) {
      filter_ = StreamFilter(96);
      int own = 0;
      int other = 0;
      EXPECT_TRUE(takes(rtp(96, 1, 0, 0), 0));
      EXPECT_TRUE(takes(rtp(96, 1, 1, 1), own_s));
      for (double now_s = own_s; own < 20;) {
        const double own_at_s = own_s * (own + 2);
        const double other_at_s = own_s + other_s * (other + 0.5);
        now_s = std::min(own_at_s, other_at_s);
        if (own_at_s <= other_at_s) {
          ++own;
          EXPECT_TRUE(takes(rtp(96, 1, static_cast<std::uint16_t>(own + 1), own + 1), now_s));
        } else {
          ++other;
          EXPECT_FALSE(takes(rtp(96, 2, static_cast<std::uint16_t>(other), other % 256), now_s));
        }
        ASSERT_FALSE(filter_.release()) << own_s << " " << other_s;
      }
      EXPECT_EQ(filter_.source(), 1U);
      EXPECT_EQ(filter_.foreign(), other);
      EXPECT_EQ(filter_.foreign_kind(), "another sender (SSRC 00000002)");
    }
  }
}

TEST_F(StreamFilterTest, ReturnsForGoodToASenderThatOnlyPaused) {
  EXPECT_TRUE(takes(rtp(96, 1, 0), 0));
  EXPECT_FALSE(takes(rtp(96, 2, 7), 2));
  EXPECT_TRUE(filter_.release());
  EXPECT_TRUE(takes(rtp(96, 1, 1), 2.1));
  for (std::uint8_t i = 0; i < 20; ++i) EXPECT_FALSE(takes(rtp(96, 2, i, i), 2.1 + 0.04 * i));
  EXPECT_TRUE(takes(rtp(96, 1, 2), 2.9));
  EXPECT_FALSE(filter_.release());
  EXPECT_FALSE(takes(rtp(96, 2, 21), 4));
  EXPECT_TRUE(filter_.release()) << "the first is silent";
}

TEST_F(StreamFilterTest, PrefersTheSourceThatWasAgreedUpon) {
  filter_ = StreamFilter(96, 7);
  EXPECT_FALSE(takes(rtp(96, 1, 0, 1), 0));
  EXPECT_FALSE(takes(rtp(96, 1, 0, 2), 0.04));
  EXPECT_TRUE(takes(rtp(96, 7), 0.06));
  EXPECT_FALSE(takes(rtp(96, 1, 0, 3), 0.08));
  EXPECT_FALSE(filter_.release());
  EXPECT_TRUE(takes(rtp(96, 7), 0.1));
  EXPECT_EQ(filter_.foreign(), 3);
}

TEST_F(StreamFilterTest, TakesAnotherSourceWhereTheOneAgreedUponNeverComes) {
  filter_ = StreamFilter(96, 7);
  for (int picture = 1; picture <= StreamFilter::kPictures; ++picture) {
    EXPECT_FALSE(filter_.release());
    EXPECT_FALSE(takes(rtp(96, 1, 0, picture), 0.04 * picture));
  }
  for (int picture = 1; picture <= StreamFilter::kPictures; ++picture) {
    EXPECT_TRUE(filter_.release());
  }
  EXPECT_TRUE(takes(rtp(96, 1, 0, 9), 0.5));
  EXPECT_TRUE(takes(rtp(96, 7), 0.6)) << "it comes late";
  EXPECT_FALSE(takes(rtp(96, 1, 0, 10), 0.61));
}

TEST_F(StreamFilterTest, HoldsNoMoreBackThanItsMemory) {
  EXPECT_TRUE(takes(rtp(96, 1)));
  Bytes large = rtp(96, 2);
  large.resize(StreamFilter::kMostHeld / 4);
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(takes(large, 0.1));
  EXPECT_EQ(filter_.foreign(), 2);
  EXPECT_TRUE(takes(rtp(96, 1), 0.2));
  EXPECT_EQ(filter_.foreign(), 6);
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

// Stamps and sequence numbers of V4L2 buffers, without a device.

#include "platform/video/v4l2_stamps.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

constexpr std::uint32_t kMonotonic = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
constexpr std::uint32_t kUnknown = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
constexpr std::uint32_t kCopied = V4L2_BUF_FLAG_TIMESTAMP_COPY;

TEST(V4l2Stamps, TakeAMonotonicStampAsItIs) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.update(0, kMonotonic, 9.5, 10).receive_time_s, 9.5);
  EXPECT_EQ(stamps.update(1, kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 9.6, 11).receive_time_s,
            9.6);
}

TEST(V4l2Stamps, TellWhatTheDriverStamped) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.update(0, kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 9.5, 10).stamped_at,
            StampedAt::kExposureStart);
  EXPECT_EQ(stamps.update(1, kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_EOF, 9.5, 10).stamped_at,
            StampedAt::kFrameEnd);
  // Where the moment of taking out has to do, the driver's word is of another time.
  EXPECT_EQ(stamps.update(2, kUnknown | V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 9.5, 10).stamped_at,
            StampedAt::kArrival);
  EXPECT_EQ(stamps.update(3, kMonotonic | V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 10.5, 10).stamped_at,
            StampedAt::kArrival);
}

TEST(V4l2Stamps, TakeTheMomentOfTakingOutWhereTheStampIsNone) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.update(0, kUnknown, 9.5, 10).receive_time_s, 10);
  EXPECT_EQ(stamps.update(1, kCopied, 9.6, 11).receive_time_s, 11);
  EXPECT_EQ(stamps.update(2, kMonotonic, 0, 12).receive_time_s, 12);
}

TEST(V4l2Stamps, DoNotBelieveAStampOfTheFuture) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.update(0, kMonotonic, 10.03, 10).receive_time_s, 10);
}

TEST(V4l2Stamps, CountWhatIsLost) {
  V4l2Stamps stamps;
  const auto first = stamps.update(7, kMonotonic, 1, 1);
  EXPECT_EQ(first.sequence, 7);
  EXPECT_EQ(first.lost, 0);
  EXPECT_EQ(stamps.update(8, kMonotonic, 2, 2).lost, 0);
  const auto after_loss = stamps.update(12, kMonotonic, 3, 3);
  EXPECT_EQ(after_loss.sequence, 12);
  EXPECT_EQ(after_loss.lost, 3);
  EXPECT_FALSE(after_loss.anew);
}

TEST(V4l2Stamps, GoOnCountingBeyond32Bits) {
  V4l2Stamps stamps;
  (void)stamps.update(0xFFFFFFFEU, kMonotonic, 1, 1);
  EXPECT_EQ(stamps.update(0xFFFFFFFFU, kMonotonic, 2, 2).sequence, 0xFFFFFFFFLL);
  const auto beyond = stamps.update(1, kMonotonic, 3, 3);
  EXPECT_EQ(beyond.sequence, 0x100000001LL);
  EXPECT_EQ(beyond.lost, 1);
  EXPECT_FALSE(beyond.anew);
}

TEST(V4l2Stamps, TellABufferThatComesTwice) {
  V4l2Stamps stamps;
  EXPECT_FALSE(stamps.update(0, kMonotonic, 1, 1).duplicate);
  EXPECT_TRUE(stamps.update(0, kMonotonic, 1, 2).duplicate);
  for (std::uint32_t sequence = 1; sequence < 6; ++sequence) {
    const auto stamp = stamps.update(sequence, kMonotonic, sequence, sequence);
    EXPECT_FALSE(stamp.duplicate);
    EXPECT_EQ(stamp.sequence, sequence);
    EXPECT_EQ(stamp.lost, 0);
    EXPECT_TRUE(stamps.update(sequence, kMonotonic, sequence + 0.5, sequence + 0.5).duplicate);
  }
}

TEST(V4l2Stamps, HaveNoSequenceOfADriverThatDoesNotCount) {
  V4l2Stamps stamps;
  int frames = 0;
  for (int i = 0; i < 10; ++i) {
    const auto stamp = stamps.update(0, kUnknown, 0, 1 + i);
    EXPECT_EQ(stamp.lost, 0);
    EXPECT_FALSE(stamp.anew);
    frames += stamp.duplicate ? 0 : 1;
    if (i >= 3) {
      EXPECT_FALSE(stamp.duplicate);
      EXPECT_FALSE(stamp.sequence);
    }
  }
  EXPECT_EQ(frames, 8) << "two were taken for duplicates";
}

TEST(V4l2Stamps, BeginAnewWhenTheNumbersGoBack) {
  V4l2Stamps stamps;
  (void)stamps.update(100, kMonotonic, 1, 1);
  (void)stamps.update(101, kMonotonic, 2, 2);
  const auto anew = stamps.update(0, kMonotonic, 3, 3);
  EXPECT_TRUE(anew.anew);
  EXPECT_EQ(anew.sequence, 0);
  EXPECT_EQ(anew.lost, 0);
  EXPECT_EQ(stamps.update(1, kMonotonic, 4, 4).sequence, 1);
}

}  // namespace
}  // namespace alidade

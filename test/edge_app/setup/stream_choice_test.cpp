// Which stream is taken, and what is said of the others.

#include "edge_app/setup/stream_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <string>
#include <vector>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

VideoStream stream_of(const std::string& codec, int width, int height, double rate_hz) {
  VideoStream stream;
  stream.codec = codec;
  stream.width = width;
  stream.height = height;
  stream.rate_hz = rate_hz;
  stream.key_frame_distance = 25;
  return stream;
}

std::size_t best_of(const std::vector<VideoStream>& streams) {
  const StreamChoice choice = choose_stream(streams);
  EXPECT_EQ(choice.remarks.size(), streams.size());
  return choice.best.value_or(99);
}

TEST(StreamChoice, TakesMostPixelsUpToFullHd) {
  const std::vector<VideoStream> streams = {
      stream_of("H264", 3840, 2160, 25), stream_of("H264", 1920, 1080, 25),
      stream_of("H264", 1280, 720, 25), stream_of("H264", 640, 360, 25)};
  const StreamChoice choice = choose_stream(streams);
  ASSERT_EQ(choice.best, 1U);
  EXPECT_THAT(choice.reason, HasSubstr("most pixels"));
  EXPECT_THAT(choice.remarks[0], HasSubstr("more pixels"));
  EXPECT_THAT(choice.remarks[1], IsEmpty());
  EXPECT_THAT(choice.remarks[3], HasSubstr("fewer pixels"));
}

TEST(StreamChoice, PrefersEnoughPicturesASecond) {
  EXPECT_EQ(best_of({stream_of("H264", 1920, 1080, 5), stream_of("H264", 1280, 720, 25)}), 1U);
  // A rate that is not told is taken for a usual one.
  EXPECT_EQ(best_of({stream_of("H264", 1920, 1080, 0), stream_of("H264", 1280, 720, 25)}), 0U);
}

TEST(StreamChoice, AmongEqualsTakesTheCodecThatIsCheapestToDecode) {
  EXPECT_EQ(best_of({stream_of("JPEG", 1920, 1080, 25), stream_of("H265", 1920, 1080, 25),
                     stream_of("H264", 1920, 1080, 25)}),
            2U);
  VideoStream main = stream_of("H264", 1920, 1080, 25);
  main.codec_profile = "Main";
  main.b_frames = VideoStream::BFrames::kPossible;
  VideoStream baseline = main;
  baseline.b_frames = VideoStream::BFrames::kNone;
  EXPECT_EQ(best_of({main, baseline}), 1U);
  EXPECT_THAT(choose_stream({main}).reason, HasSubstr("its profile Main permits B-frames"));
}

TEST(StreamChoice, LeavesOutWhatCannotBeUsed) {
  EXPECT_EQ(best_of({stream_of("MPEG4", 1920, 1080, 25), stream_of("H264", 640, 360, 25)}), 1U);
  EXPECT_EQ(best_of({stream_of("JPEG", 3840, 2160, 25), stream_of("JPEG", 640, 360, 25)}), 1U);
  const StreamChoice none = choose_stream({stream_of("MPEG4", 1920, 1080, 25)});
  EXPECT_FALSE(none.best);
  EXPECT_THAT(none.reason, HasSubstr("'MPEG4' is not supported; set H264"));
  EXPECT_FALSE(choose_stream({}).best);
  EXPECT_THAT(choose_stream({}).reason, HasSubstr("no stream"));
}

TEST(StreamChoice, SaysWhatToSetInTheDevice) {
  VideoStream stream = stream_of("H264", 1920, 1080, 25);
  stream.key_frame_distance = 250;
  EXPECT_THAT(choose_stream({stream}).reason, HasSubstr("250 pictures apart is 10.0 s"));
  stream.key_frame_distance = 50;
  stream.rate_hz = 10;
  EXPECT_THAT(choose_stream({stream}).reason, HasSubstr("set 25 pictures a second"));
}

V4l2Size size_of(int width, int height, double rate_hz) {
  V4l2Size size;
  size.least_width = size.greatest_width = width;
  size.least_height = size.greatest_height = height;
  if (rate_hz > 0) size.rates.push_back({rate_hz, rate_hz});
  return size;
}

TEST(V4l2Modes, BeginWithTheBest) {
  const std::vector<V4l2Offer> offers = {
      {V4L2_PIX_FMT_YUYV, {size_of(1920, 1080, 5), size_of(640, 480, 30)}},
      {V4L2_PIX_FMT_MJPEG, {size_of(1920, 1080, 30), size_of(640, 480, 30)}},
      {V4L2_PIX_FMT_H264, {size_of(1920, 1080, 60)}}};  // not read by V4L2
  const auto modes = ordered_modes(offers);
  ASSERT_EQ(modes.size(), 4U);
  EXPECT_EQ(modes[0].format, V4l2Format::kMjpg);
  EXPECT_EQ(modes[0].width, 1920);
  EXPECT_EQ(modes[0].rate_hz, 30);
  // Of the same size and rate, luma that needs no decoding.
  EXPECT_EQ(modes[2].format, V4l2Format::kYuyv);
  EXPECT_EQ(modes[2].width, 640);
}

TEST(V4l2Modes, OfAContinuousRangeTakesAUsefulRate) {
  V4l2Size size = size_of(1280, 720, 0);
  size.rates.push_back({1, 120});
  const auto modes = ordered_modes({{V4L2_PIX_FMT_GREY, {size}}});
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_EQ(modes[0].rate_hz, 30);
}

}  // namespace
}  // namespace alidade

// The decoder as live streams need it: a picture in, the same picture out.

#include "platform/video/luma_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "test/platform/support/coded_stream.h"

namespace alidade {
namespace {

PacketPtr packet_of(const std::string& data, std::int64_t pts) {
  PacketPtr packet(av_packet_alloc());
  EXPECT_EQ(av_new_packet(packet.get(), static_cast<int>(data.size())), 0);
  std::copy(data.begin(), data.end(), packet->data);
  packet->pts = pts;
  return packet;
}

class LumaDecoderDelay : public ::testing::TestWithParam<std::tuple<CodedBy, int, bool>> {};

INSTANTIATE_TEST_SUITE_P(Streams, LumaDecoderDelay,
                         ::testing::Combine(::testing::Values(CodedBy::kH264, CodedBy::kH265),
                                            ::testing::Values(0, 2), ::testing::Bool()));

TEST_P(LumaDecoderDelay, IsNoneWhateverTheParameterSetsAllowFor) {
  CodedStreamOptions options;
  std::tie(options.codec, options.allowed_to_overtake, options.sets_in_band) = GetParam();
  const CodedStream stream = coded_stream(options);
  ASSERT_EQ(stream.pictures.size(), 12U);
  LumaDecoder decoder;
  ASSERT_TRUE(decoder.open(*stream.parameters, true)) << decoder.error();
  EXPECT_TRUE(decoder.is_beginning());
  for (std::size_t i = 0; i < stream.pictures.size(); ++i) {
    const auto pts = static_cast<std::int64_t>(i);
    ASSERT_TRUE(decoder.send(packet_of(stream.pictures[i], pts).get())) << i;
    Picture picture;
    ASSERT_EQ(decoder.receive(&picture), LumaDecoder::Result::kPicture) << i;
    EXPECT_EQ(picture.pts, pts);
    EXPECT_EQ(picture.width, 160);
    EXPECT_EQ(picture.height, 128);
    EXPECT_FALSE(picture.interlaced);
    EXPECT_FALSE(decoder.is_beginning());
    EXPECT_EQ(decoder.receive(&picture), LumaDecoder::Result::kNone) << i;
  }
}

// Pictures of 14 MB: what a camera keeps, and what a peer may claim.
class LumaDecoderReferences : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(, LumaDecoderReferences, ::testing::Values(1, 3, 16));

TEST_P(LumaDecoderReferences, AreBoundedByTheirMemory) {
  CodedStreamOptions options;
  options.width = 4096;
  options.height = 2304;
  options.pictures = 8;
  options.key_every = 100;
  options.references = GetParam();
  const CodedStream stream = coded_stream(options);
  LumaDecoder decoder;
  ASSERT_TRUE(decoder.open(*stream.parameters, true)) << decoder.error();
  std::vector<Picture> given;  // whoever has them keeps them
  for (std::size_t i = 0; i < stream.pictures.size(); ++i) {
    if (!decoder.send(packet_of(stream.pictures[i], static_cast<std::int64_t>(i)).get())) break;
    ASSERT_EQ(decoder.receive(&given.emplace_back()), LumaDecoder::Result::kPicture) << i;
  }
  const bool too_many = GetParam() > 4;
  EXPECT_EQ(decoder.keeps_too_many(), too_many);
  EXPECT_EQ(given.size(), too_many ? 5U : stream.pictures.size());
  if (too_many) EXPECT_EQ(decoder.error().find("the stream keeps more reference pictures"), 0U);
}

TEST(LumaDecoder, TellsInterlacedCoding) {
  CodedStreamOptions options;
  options.interlaced = true;
  const CodedStream stream = coded_stream(options);
  LumaDecoder decoder;
  ASSERT_TRUE(decoder.open(*stream.parameters, true)) << decoder.error();
  ASSERT_TRUE(decoder.send(packet_of(stream.pictures[0], 0).get()));
  Picture picture;
  ASSERT_EQ(decoder.receive(&picture), LumaDecoder::Result::kPicture);
  EXPECT_TRUE(picture.interlaced);
}

TEST(LumaDecoder, BeginsAnewAtTheNextKeyFrameWhenFlushed) {
  for (const CodedBy codec : {CodedBy::kH264, CodedBy::kH265}) {
    CodedStreamOptions options;
    options.codec = codec;
    const CodedStream stream = coded_stream(options);
    LumaDecoder decoder;
    ASSERT_TRUE(decoder.open(*stream.parameters, true)) << decoder.error();
    Picture picture;
    for (const std::size_t i : {0U, 1U, 10U, 11U}) {
      if (i == 10) decoder.flush();
      EXPECT_EQ(decoder.is_beginning(), i == 0 || i == 10);
      ASSERT_TRUE(decoder.send(packet_of(stream.pictures[i], static_cast<std::int64_t>(i)).get()));
      ASSERT_EQ(decoder.receive(&picture), LumaDecoder::Result::kPicture) << i;
      EXPECT_EQ(picture.pts, static_cast<std::int64_t>(i));
    }
  }
}

}  // namespace
}  // namespace alidade

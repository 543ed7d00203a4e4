#include "test/simulator/servers/encoder.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

extern "C" {
#include <libavcodec/avcodec.h>
}

#include <algorithm>
#include <cmath>
#include <memory>

#include "test/simulator/servers/av_client.h"

namespace alidade {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;

double mean_difference(const std::uint8_t* a, std::ptrdiff_t stride_a, const std::uint8_t* b,
                       std::ptrdiff_t stride_b) {
  double sum = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) sum += std::abs(a[v * stride_a + u] - b[v * stride_b + u]);
  }
  return sum / (kWidth * kHeight);
}

using Standard = VideoEncoder::Standard;

constexpr Standard kStandards[] = {Standard::kH264, Standard::kH265};

// The types of the NAL units of an Annex B access unit.
std::vector<int> nal_types(Standard standard, const std::vector<std::uint8_t>& access_unit) {
  std::vector<int> types;
  for (std::size_t i = 3; i < access_unit.size(); ++i) {
    if (access_unit[i - 3] == 0 && access_unit[i - 2] == 0 && access_unit[i - 1] == 1) {
      types.push_back(standard == Standard::kH265 ? access_unit[i] >> 1 & 0x3f
                                                  : access_unit[i] & 0x1f);
    }
  }
  return types;
}

bool has(const std::vector<int>& types, int type) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

struct NalTypes {
  int idr;
  int sps;
  int pps;
};
constexpr NalTypes types_of(Standard standard) {
  return standard == Standard::kH265 ? NalTypes{19, 33, 34} : NalTypes{5, 7, 8};
}

TEST(EncodeJpeg, MakesABaselineFrameInYuv420ThatDecodesToThePicture) {
  const auto picture = numbered_picture(kWidth, kHeight, 1234);
  const auto jpeg = encode_jpeg(picture.data(), kWidth, kHeight, kWidth, 90);
  tjhandle handle = tjInitDecompress();
  int width = 0;
  int height = 0;
  int subsampling = -1;
  int colorspace = -1;
  EXPECT_EQ(tjDecompressHeader3(handle, jpeg.data(), jpeg.size(), &width, &height, &subsampling,
                                &colorspace),
            0);
  EXPECT_EQ(width, kWidth);
  EXPECT_EQ(height, kHeight);
  EXPECT_EQ(subsampling, TJSAMP_420);
  EXPECT_EQ(colorspace, TJCS_YCbCr);
  std::vector<std::uint8_t> decoded(picture.size());
  EXPECT_EQ(tjDecompress2(handle, jpeg.data(), jpeg.size(), decoded.data(), kWidth, 0, kHeight,
                          TJPF_GRAY, 0),
            0);
  tjDestroy(handle);
  EXPECT_LT(mean_difference(picture.data(), kWidth, decoded.data(), kWidth), 2);
  EXPECT_EQ(read_number(decoded.data(), kWidth, kWidth), 1234);
  constexpr std::uint8_t kBaseline[] = {0xff, 0xc0};
  EXPECT_NE(std::search(jpeg.begin(), jpeg.end(), std::begin(kBaseline), std::end(kBaseline)),
            jpeg.end());
}

TEST(EncodeJpeg, HonoursTheStride) {
  constexpr int kStride = kWidth + 37;
  const auto picture = numbered_picture(kWidth, kHeight, 7);
  std::vector<std::uint8_t> padded(std::size_t{kStride} * kHeight, 255);
  for (std::ptrdiff_t v = 0; v < kHeight; ++v) {
    std::copy_n(picture.begin() + v * kWidth, kWidth, padded.begin() + v * kStride);
  }
  EXPECT_EQ(encode_jpeg(padded.data(), kWidth, kHeight, kStride, 90),
            encode_jpeg(picture.data(), kWidth, kHeight, kWidth, 90));
}

TEST(EncodeJpeg, GivesNothingForAnImpossiblePicture) {
  const std::uint8_t pixel = 0;
  EXPECT_TRUE(encode_jpeg(&pixel, 0, 1, 1, 90).empty());
  EXPECT_TRUE(encode_jpeg(&pixel, 1, 1, 1, 0).empty());
  EXPECT_TRUE(encode_jpeg(&pixel, 1, 1, 1, 101).empty());
}

class VideoEncoderOf : public testing::TestWithParam<Standard> {};

INSTANTIATE_TEST_SUITE_P(Standards, VideoEncoderOf, testing::ValuesIn(kStandards),
                         [](const auto& standard) {
                           return standard.param == Standard::kH265 ? "H265" : "H264";
                         });

TEST_P(VideoEncoderOf, GivesEachPictureBackWithoutDelay) {
  VideoEncoder encoder;
  std::string error;
  ASSERT_TRUE(encoder.open(GetParam(), kWidth, kHeight, 25, &error)) << error;
  AVCodecContext* decoder = avcodec_alloc_context3(
      avcodec_find_decoder(GetParam() == Standard::kH265 ? AV_CODEC_ID_HEVC : AV_CODEC_ID_H264));
  decoder->flags |= AV_CODEC_FLAG_LOW_DELAY;
  decoder->thread_count = 1;
  ASSERT_EQ(avcodec_open2(decoder, nullptr, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  for (int number = 0; number < 30; ++number) {
    const auto picture = numbered_picture(kWidth, kHeight, number);
    const auto access_unit = encoder.encode(picture.data(), kWidth, false);
    EXPECT_EQ(av_new_packet(packet, static_cast<int>(access_unit.size())), 0);
    std::copy(access_unit.begin(), access_unit.end(), packet->data);
    EXPECT_EQ(avcodec_send_packet(decoder, packet), 0);
    av_packet_unref(packet);
    EXPECT_EQ(avcodec_receive_frame(decoder, frame), 0) << "picture " << number;
    EXPECT_EQ(read_number(frame->data[0], kWidth, frame->linesize[0]), number);
    EXPECT_LT(mean_difference(picture.data(), kWidth, frame->data[0], frame->linesize[0]), 4);
  }
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&decoder);
}

TEST_P(VideoEncoderOf, BeginsEverySecondAndEveryForcedPictureWithAnIdrAndItsParameters) {
  constexpr int kRate = 10;
  constexpr int kForced = 13;
  const NalTypes nal = types_of(GetParam());
  VideoEncoder encoder;
  std::string error;
  ASSERT_TRUE(encoder.open(GetParam(), kWidth, kHeight, kRate, &error)) << error;
  for (int number = 0; number < 30; ++number) {
    const auto picture = numbered_picture(kWidth, kHeight, number);
    const auto types =
        nal_types(GetParam(), encoder.encode(picture.data(), kWidth, number == kForced));
    // A forced IDR begins a new second.
    const bool idr = number < kForced ? number % kRate == 0 : (number - kForced) % kRate == 0;
    EXPECT_EQ(has(types, nal.idr) || (GetParam() == Standard::kH265 && has(types, nal.idr + 1)),
              idr)
        << "picture " << number;
    EXPECT_EQ(has(types, nal.sps), idr) << "picture " << number;
    EXPECT_EQ(has(types, nal.pps), idr) << "picture " << number;
  }
}

TEST(VideoEncoder, RefusesOddSizesAndNoRate) {
  VideoEncoder encoder;
  std::string error;
  EXPECT_FALSE(encoder.open(Standard::kH264, 161, 120, 25, &error));
  EXPECT_NE(error.find("161x120"), std::string::npos) << error;
  EXPECT_FALSE(encoder.open(Standard::kH265, 160, 120, 0, &error));
  EXPECT_NE(error.find("frame rate"), std::string::npos) << error;
  EXPECT_TRUE(encoder.encode(nullptr, 0, false).empty());
}

}  // namespace
}  // namespace alidade

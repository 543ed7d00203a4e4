// The choice of a V4L2 mode, its messages, and the luma of raw pictures, without a device.

#include "platform/video/v4l2_mode.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace alidade {
namespace {

V4l2Size discrete(int width, int height, std::vector<double> rates_hz = {}) {
  V4l2Size size;
  size.least_width = size.greatest_width = width;
  size.least_height = size.greatest_height = height;
  for (const double rate_hz : rates_hz) {
    size.rates.push_back({rate_hz, rate_hz});
  }
  return size;
}

// A webcam: slow when large and raw.
const std::vector<V4l2Offer> kWebcam = {
    {V4L2_PIX_FMT_MJPEG, {discrete(1920, 1080, {30, 15}), discrete(640, 480, {60, 30})}},
    {V4L2_PIX_FMT_YUYV, {discrete(1920, 1080, {5}), discrete(640, 480, {30, 29.97, 12.5})}},
    {V4L2_PIX_FMT_SBGGR8, {discrete(1920, 1080, {30})}}};

std::optional<std::uint32_t> choose(const std::vector<V4l2Offer>& offers, const V4l2Wish& wish) {
  std::string error;
  const auto chosen = choose_format(offers, wish, &error);
  EXPECT_TRUE(chosen) << error;
  return chosen;
}

std::string refusal(const std::vector<V4l2Offer>& offers, const V4l2Wish& wish) {
  std::string error;
  EXPECT_FALSE(choose_format(offers, wish, &error));
  return error;
}

TEST(V4l2Mode, TakesTheFormatThatIsWanted) {
  EXPECT_EQ(choose(kWebcam, {V4l2Format::kMjpg, 640, 480, 60}), V4L2_PIX_FMT_MJPEG);
  EXPECT_EQ(choose(kWebcam, {V4l2Format::kYuyv, 0, 0, 0}), V4L2_PIX_FMT_YUYV);
}

TEST(V4l2Mode, PrefersLumaThatLiesReadyAndCompressesLast) {
  EXPECT_EQ(choose(kWebcam, {}), V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(choose({{V4L2_PIX_FMT_UYVY, {}}, {V4L2_PIX_FMT_NV12, {}}, {V4L2_PIX_FMT_GREY, {}}}, {}),
            V4L2_PIX_FMT_GREY);
}

TEST(V4l2Mode, TakesAnotherFormatWhereTheRateNeedsIt) {
  EXPECT_EQ(choose(kWebcam, {{}, 1920, 1080, 30}), V4L2_PIX_FMT_MJPEG);
  EXPECT_EQ(choose(kWebcam, {{}, 640, 480, 30}), V4L2_PIX_FMT_YUYV);
}

TEST(V4l2Mode, TakesARateOfTheTelevisionStandardsForTheRoundOne) {
  EXPECT_EQ(choose({{V4L2_PIX_FMT_GREY, {discrete(8, 8, {59.94})}}}, {{}, 8, 8, 60}),
            V4L2_PIX_FMT_GREY);
  EXPECT_TRUE(same_rate(29.97, 30));
  EXPECT_FALSE(same_rate(25, 30));
}

TEST(V4l2Mode, TrustsADeviceThatDoesNotTellItsSizes) {
  EXPECT_EQ(choose({{V4L2_PIX_FMT_GREY, {}}}, {V4l2Format::kGrey, 1280, 720, 60}),
            V4L2_PIX_FMT_GREY);
  EXPECT_EQ(
      choose({{V4L2_PIX_FMT_GREY, {}}, {V4L2_PIX_FMT_YUYV, {discrete(64, 48)}}}, {{}, 64, 48, 60}),
      V4L2_PIX_FMT_YUYV)
      << "what is told goes first";
}

TEST(V4l2Mode, KeepsToTheStepsOfARange) {
  V4l2Size range;
  range.least_width = range.least_height = 16;
  range.greatest_width = 4096;
  range.greatest_height = 2160;
  range.width_step = 16;
  range.height_step = 2;
  range.rates.push_back({1, 60});
  const std::vector<V4l2Offer> offers = {{V4L2_PIX_FMT_GREY, {range}}};
  EXPECT_EQ(choose(offers, {{}, 1280, 720, 12.5}), V4L2_PIX_FMT_GREY);
  EXPECT_EQ(refusal(offers, {{}, 1288, 720, 0}),
            "offers no 1288x720; it offers GREY 16x16 to 4096x2160");
  EXPECT_EQ(refusal(offers, {{}, 1280, 2162, 0}),
            "offers no 1280x2162; it offers GREY 16x16 to 4096x2160");
  EXPECT_EQ(refusal(offers, {{}, 1280, 720, 75}),
            "offers no 1280x720 at 75 Hz; it offers GREY 1 to 60 Hz");
}

TEST(V4l2Mode, SaysWhatTheDeviceOffers) {
  EXPECT_EQ(refusal(kWebcam, {V4l2Format::kGrey, 640, 480, 30}),
            "offers no GREY; it offers MJPG, YUYV, BA81");
  EXPECT_EQ(refusal(kWebcam, {V4l2Format::kYuyv, 1280, 720, 30}),
            "offers no YUYV 1280x720; it offers YUYV 1920x1080, 640x480");
  EXPECT_EQ(refusal(kWebcam, {V4l2Format::kYuyv, 640, 480, 60}),
            "offers no YUYV 640x480 at 60 Hz; it offers YUYV 30, 29.97, 12.5 Hz");
  EXPECT_EQ(refusal(kWebcam, {{}, 1280, 720, 0}),
            "offers no 1280x720; it offers YUYV 1920x1080, 640x480; MJPG 1920x1080, 640x480");
  EXPECT_EQ(refusal(kWebcam, {{}, 1920, 1080, 60}),
            "offers no 1920x1080 at 60 Hz; it offers YUYV 5 Hz; MJPG 30, 15 Hz");
  EXPECT_EQ(refusal({{V4L2_PIX_FMT_SBGGR8, {}}}, {}),
            "offers none of GREY, NV12, YUYV, UYVY, MJPG; it offers BA81");
  EXPECT_EQ(refusal({}, {V4l2Format::kGrey, 0, 0, 0}),
            "offers no GREY; it offers no format at all");
}

TEST(V4l2Mode, KnowsItsFormatsByNameAndCode) {
  for (const char* name : {"GREY", "NV12", "YUYV", "UYVY", "MJPG"}) {
    const auto format = v4l2_format_of_name(std::string(name));
    ASSERT_TRUE(format);
    EXPECT_STREQ(to_string(*format), name);
    EXPECT_EQ(v4l2_format_of_code(v4l2_fourcc(name[0], name[1], name[2], name[3])), format);
  }
  EXPECT_EQ(v4l2_format_of_code(std::uint32_t{V4L2_PIX_FMT_JPEG}), V4l2Format::kMjpg);
  EXPECT_FALSE(v4l2_format_of_name(std::string("BA81")));
}

// Luma u + 10 v, everything else 255.
class V4l2Luma : public ::testing::TestWithParam<V4l2Format> {};

TEST_P(V4l2Luma, IsTakenOutOfRowsWithGaps) {
  const V4l2Format format = GetParam();
  constexpr int kWidth = 37;  // no multiple of a vector's length
  constexpr int kHeight = 3;
  constexpr std::size_t kStride = 2 * kWidth + 6;
  std::vector<std::uint8_t> picture(raw_picture_bytes(format, kWidth, kHeight, kStride), 255);
  ASSERT_LE(picture.size(), kHeight * kStride);
  for (std::size_t v = 0; v < kHeight; ++v) {
    for (std::size_t u = 0; u < kWidth; ++u) {
      picture.at(v * kStride + luma_offset(format) + u * luma_step(format)) =
          static_cast<std::uint8_t>(u + 10 * v);
    }
  }
  std::vector<std::uint8_t> luma(kWidth * kHeight + 1, 77);
  copy_luma(format, picture.data(), kWidth, kHeight, kStride, luma.data());
  for (std::size_t v = 0; v < kHeight; ++v) {
    for (std::size_t u = 0; u < kWidth; ++u) {
      ASSERT_EQ(luma[v * kWidth + u], u + 10 * v);
    }
  }
  EXPECT_EQ(luma.back(), 77);
}

INSTANTIATE_TEST_SUITE_P(Formats, V4l2Luma,
                         ::testing::Values(V4l2Format::kGrey, V4l2Format::kNv12, V4l2Format::kYuyv,
                                           V4l2Format::kUyvy),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

}  // namespace
}  // namespace alidade

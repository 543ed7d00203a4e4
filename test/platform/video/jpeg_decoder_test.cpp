#include "platform/video/jpeg_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace alidade {
namespace {

using ::testing::HasSubstr;

const std::string kBegin = "\xFF\xD8";
const std::string kEnd = "\xFF\xD9";
const std::string kQuantization = std::string("\xFF\xDB\x00\x43\x00", 5) + std::string(64, '\x10');
// Grey, 8x8. The one Huffman code of each table is a single 0: for a difference of four bits, and for
// the end of a block.
const std::string kBaseline("\xFF\xC0\x00\x0B\x08\x00\x08\x00\x08\x01\x01\x11\x00", 13);
const std::string kProgressive("\xFF\xC2\x00\x0B\x08\x00\x08\x00\x08\x01\x01\x11\x00", 13);
const std::string kDcCodes =
    std::string("\xFF\xC4\x00\x14\x00\x01", 6) + std::string(15, '\0') + '\x04';
const std::string kAcCodes =
    std::string("\xFF\xC4\x00\x14\x10\x01", 6) + std::string(15, '\0') + '\0';
const std::string kWholeScan("\xFF\xDA\x00\x08\x01\x01\x00\x00\x3F\x00\x0B", 11);
const std::string kDcScan("\xFF\xDA\x00\x08\x01\x01\x00\x00\x00\x00\x0B", 11);
const std::string kGood =
    kBegin + kQuantization + kBaseline + kDcCodes + kAcCodes + kWholeScan + kEnd;

TEST(JpegDecoder, DecodesAPictureByHand) {
  JpegDecoder decoder;
  Picture picture;
  ASSERT_TRUE(decoder.decode(kGood, &picture)) << decoder.error();
  EXPECT_EQ(picture.width, 8);
  EXPECT_EQ(picture.height, 8);
}

TEST(JpegDecoder, UsesMemoryAgainThatNobodyLooksAt) {
  JpegDecoder decoder;
  Picture first;
  Picture second;
  ASSERT_TRUE(decoder.decode(kGood, &first));
  ASSERT_TRUE(decoder.decode(kGood, &second));
  const std::uint8_t* const of_first = first.luma;
  EXPECT_NE(second.luma, of_first) << "while somebody looks at it";
  first = {};
  Picture third;
  ASSERT_TRUE(decoder.decode(kGood, &third));
  EXPECT_EQ(third.luma, of_first);
}

TEST(JpegDecoder, LeavesAPictureItsMemoryWhenItGoes) {
  Picture picture;
  {
    JpegDecoder decoder;
    ASSERT_TRUE(decoder.decode(kGood, &picture));
  }
  const int grey = picture.luma[0];
  EXPECT_EQ(picture.luma[63], grey);
}

// To the library tables without a picture are a whole stream.
TEST(JpegDecoder, RefusesAPictureWithoutASize) {
  for (const std::string& tables : {kBegin + kEnd, kBegin + kQuantization + kEnd}) {
    JpegDecoder decoder;
    int width = 640;
    int height = 480;
    EXPECT_FALSE(decoder.read_size(tables, &width, &height));
    EXPECT_THAT(decoder.error(), HasSubstr("it has no size"));
    Picture picture;
    EXPECT_FALSE(decoder.decode(tables, &picture));
    EXPECT_TRUE(decoder.decode(kGood, &picture)) << decoder.error();
  }
}

// Each of a few bytes, and each as much work as a picture.
TEST(JpegDecoder, RefusesAPictureOfThousandsOfScans) {
  std::string picture_of_scans = kBegin + kQuantization + kProgressive + kDcCodes;
  for (int i = 0; i < 2000; ++i) picture_of_scans += kDcScan;
  picture_of_scans += kEnd;
  JpegDecoder decoder;
  Picture picture;
  EXPECT_FALSE(decoder.decode(picture_of_scans, &picture));
  EXPECT_THAT(decoder.error(), HasSubstr("more than 500 scans"));
  EXPECT_TRUE(decoder.decode(kGood, &picture)) << decoder.error();
}

}  // namespace
}  // namespace alidade

#include "platform/video/coded_picture.h"

#include <gtest/gtest.h>

#include <string>

#include "test/platform/support/coded_stream.h"

namespace alidade {
namespace {

using namespace std::string_literals;

const std::string kStart = "\0\0\1"s;
const std::string kLongStart = "\0\0\0\1"s;

CodedPicture look(CodedBy codec, const std::string& data) {
  return look_at(codec, reinterpret_cast<const std::uint8_t*>(data.data()), data.size());
}

std::optional<std::string> in_order(CodedBy codec, const std::string& data) {
  const auto changed =
      without_reordering(codec, reinterpret_cast<const std::uint8_t*>(data.data()), data.size());
  if (!changed) return std::nullopt;
  return std::string(changed->begin(), changed->end());
}

// Slices: of H.264 a P picture, its first or not; of H.265 a trailing picture, the same.
const std::string kH264First = kStart + "\x41\x9A\x00\x01"s;
const std::string kH264Second = kStart + "\x41\x5A\x00\x01"s;
const std::string kH265First = kStart + "\x02\x01\xD0\x01"s;
const std::string kH265Second = kStart + "\x02\x01\x50\x01"s;

TEST(CodedPicture, BeginsWithItsFirstSlice) {
  EXPECT_TRUE(look(CodedBy::kH264, kH264First).has_beginning);
  EXPECT_FALSE(look(CodedBy::kH264, kH264Second + kH264First).has_beginning);
  EXPECT_TRUE(look(CodedBy::kH265, kH265First).has_beginning);
  EXPECT_FALSE(look(CodedBy::kH265, kH265Second + kH265First).has_beginning);
  // Behind an access unit delimiter, and where nothing but it came.
  EXPECT_TRUE(look(CodedBy::kH264, kLongStart + "\x09\xF0"s + kH264First).has_beginning);
  EXPECT_FALSE(look(CodedBy::kH264, kLongStart + "\x09\xF0"s).has_beginning);
}

TEST(CodedPicture, NeedsNoOtherWhereAnEncoderSetsAKeyFrame) {
  for (const CodedBy codec : {CodedBy::kH264, CodedBy::kH265}) {
    CodedStreamOptions options;
    options.codec = codec;
    const CodedStream stream = coded_stream(options);
    for (std::size_t i = 0; i < stream.pictures.size(); ++i) {
      const CodedPicture picture = look(codec, stream.pictures[i]);
      EXPECT_TRUE(picture.has_beginning) << i;
      EXPECT_EQ(picture.needs_no_other, i % 10 == 0) << i;
      EXPECT_FALSE(picture.right_after) << i;
    }
  }
}

TEST(CodedPicture, TellsHowManyPicturesAfterARecoveryPointAllIsRight) {
  const struct {
    CodedBy codec;
    std::string sei;
    std::optional<int> right_after;
  } cases[] = {
      {CodedBy::kH264, "\x06\x06\x01\xC4\x80"s, 0},                  // ue: 1
      {CodedBy::kH264, "\x06\x06\x01\x71\x80"s, 2},                  // ue: 011
      {CodedBy::kH264, "\x06\x06\x02\x04\x24\x80"s, 32},             // ue: 00000 100001
      {CodedBy::kH264, "\x06\x05\x02\xAA\xBB\x06\x01\x71\x80"s, 2},  // behind another message
      {CodedBy::kH264, "\x06\x05\x02\xAA\xBB\x80"s, std::nullopt},   // another message only
      {CodedBy::kH264, "\x06\x06\x09\x71\x80"s, std::nullopt},       // cut off
      {CodedBy::kH264, "\x06\x06\x01\x00\x00\x00"s, std::nullopt},   // no end to the number
      {CodedBy::kH264, "\x06\xFF\x05\x00"s, std::nullopt},           // type 260, empty
      {CodedBy::kH264, "\x06\x06\x06\x00\x00\x08\x00\x00\x40\x80"s,
       1 << 15},                                         // more than there can be
      {CodedBy::kH265, "\x4E\x01\x06\x01\x25\x80"s, 2},  // se: 00100
      {CodedBy::kH265, "\x4E\x01\x06\x01\xA0\x80"s, 0},  // se: 1
      {CodedBy::kH265, "\x4E\x01\x06\x01\x70\x80"s, 0},  // se: 011, -1: behind it already
      {CodedBy::kH265, "\x4E\x09\x06\x01\x25\x80"s, std::nullopt},  // of another layer
  };
  for (const auto& which : cases) {
    const std::string& slice = which.codec == CodedBy::kH264 ? kH264First : kH265First;
    const CodedPicture picture = look(which.codec, kLongStart + which.sei + slice);
    EXPECT_EQ(picture.right_after, which.right_after) << &which - cases;
    EXPECT_TRUE(picture.has_beginning) << &which - cases;
    EXPECT_FALSE(picture.needs_no_other) << &which - cases;
  }
}

TEST(CodedPictureOrder, IsLeftAloneWhereNothingMayOvertake) {
  for (const CodedBy codec : {CodedBy::kH264, CodedBy::kH265}) {
    CodedStreamOptions options;
    options.codec = codec;
    for (const std::string& picture : coded_stream(options).pictures) {
      EXPECT_EQ(in_order(codec, picture), std::nullopt);
    }
    EXPECT_EQ(in_order(codec, ""), std::nullopt);
  }
}

TEST(CodedPictureOrder, IsForbiddenToChangeInEachParameterSetAndNothingElseIsTouched) {
  for (const CodedBy codec : {CodedBy::kH264, CodedBy::kH265}) {
    CodedStreamOptions options;
    options.codec = codec;
    options.allowed_to_overtake = 2;
    const CodedStream stream = coded_stream(options);
    for (std::size_t i = 0; i < stream.pictures.size(); ++i) {
      const std::string& picture = stream.pictures[i];
      const auto changed = in_order(codec, picture);
      ASSERT_EQ(changed.has_value(), i % 10 == 0) << i;
      if (!changed) continue;
      EXPECT_LE(changed->size(), picture.size());
      EXPECT_EQ(in_order(codec, *changed), std::nullopt) << "nothing is left to be changed";
      // The slice, and what stands before the set.
      EXPECT_EQ(changed->substr(changed->size() - 1000), picture.substr(picture.size() - 1000));
      EXPECT_EQ(changed->substr(0, 8), picture.substr(0, 8));
    }
  }
}

}  // namespace
}  // namespace alidade

#include "platform/system/random.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace alidade {
namespace {

TEST(Random, HasTheLengthThatIsAsked) {
  EXPECT_EQ(random_bytes(0).size(), 0U);
  EXPECT_EQ(random_bytes(16).size(), 16U);
  EXPECT_EQ(random_bytes(257).size(), 256U);
  EXPECT_EQ(random_hex(0), "");
  EXPECT_EQ(random_hex(7).size(), 7U);
  EXPECT_EQ(random_hex(32).size(), 32U);
}

TEST(Random, HexHasEachDigitAndNoOther) {
  const std::string text = random_hex(512);
  EXPECT_EQ(text.find_first_not_of("0123456789abcdef"), std::string::npos) << text;
  // A digit is missing from 512 with probability 16 * (15/16)^512 = 7e-14.
  EXPECT_EQ(std::set<char>(text.begin(), text.end()).size(), 16U);
}

TEST(Random, TwoAreNeverTheSame) { EXPECT_NE(random_bytes(16), random_bytes(16)); }

}  // namespace
}  // namespace alidade

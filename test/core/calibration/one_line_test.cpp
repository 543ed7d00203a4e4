// An error that a terminal shows as it is.

#include "core/calibration/one_line.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

namespace alidade {
namespace {

TEST(OneLine, ShowsControlCharactersAsQuestionMarks) {
  EXPECT_EQ(one_line("a\nb\x1b[2Jc\x7f"), "a?b?[2Jc?");
  EXPECT_EQ(one_line("G\xc3\xa4nge"), "G\xc3\xa4nge");
}

TEST(OneLine, LeavesAThousandBytes) {
  const std::string text(1000, 'a');
  EXPECT_EQ(one_line(text), text);
  EXPECT_EQ(one_line(text + "a"), text.substr(0, 997) + "...");
}

TEST(OneLine, IsCutBetweenTwoCharacters) {
  const std::string of_four = "\xf0\x9f\x98\x80";
  for (std::size_t before = 990; before < 1000; ++before) {
    const std::string text = std::string(before, 'a') + of_four + of_four + of_four;
    const std::size_t whole = before > 997 ? 997 : before + (997 - before) / 4 * 4;
    EXPECT_EQ(one_line(text), text.substr(0, whole) + "...") << before;
  }
}

TEST(OneLine, CutsWhatIsNotUtf8Anywhere) {
  EXPECT_EQ(one_line(std::string(2000, '\x80')), std::string(997, '\x80') + "...");
}

}  // namespace
}  // namespace alidade

// Of a build without OpenCV's aruco.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/pattern/known_pattern.h"
#include "test/simulator/pattern_board.h"

namespace alidade {
namespace {

TEST(NoCharuco, IsSaidInOneLineWithThePackageThatHelps) {
  for (const char* text : {"charuco:9x6:30mm:22mm", "charuco:9x6:30mm:22mm:6x6_250", "charuco"}) {
    std::string error;
    EXPECT_FALSE(parse_pattern(text, &error));
    EXPECT_EQ(error,
              "'" + std::string(text) +
                  "': this build of alidade cannot find ChArUco boards; build it with Debian's "
                  "package libopencv-contrib-dev installed");
  }
  EXPECT_FALSE(simulator::PatternBoard::has_charuco());
}

}  // namespace
}  // namespace alidade

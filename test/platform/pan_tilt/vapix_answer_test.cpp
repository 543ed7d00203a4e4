#include "platform/pan_tilt/vapix_answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>

#include "platform/pan_tilt/axis_mapping.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(VapixAnswer, TurnsDegreesIntoRadians) {
  VapixPosition position;
  std::string error;
  ASSERT_TRUE(parse_vapix_position(
      "pan=51.2891\r\ntilt=-46.1914\r\nzoom=1234.5\r\nautofocus=on\r\niris=5000\r\n", &position,
      &error))
      << error;
  EXPECT_DOUBLE_EQ(position.pan_rad, 51.2891 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(position.tilt_rad, -46.1914 * kRadPerDeg);
  EXPECT_EQ(position.zoom, 1234.5);
}

TEST(VapixAnswer, NeedsNeitherZoomNorCarriageReturnsNorOrder) {
  VapixPosition position;
  std::string error;
  ASSERT_TRUE(parse_vapix_position(" tilt = 1e1 \npan=-180", &position, &error)) << error;
  EXPECT_DOUBLE_EQ(position.pan_rad, -180 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(position.tilt_rad, 10 * kRadPerDeg);
  EXPECT_EQ(position.zoom, std::nullopt);
}

TEST(VapixAnswer, RepeatsTheCamerasOwnError) {
  VapixPosition position;
  std::string error;
  EXPECT_FALSE(
      parse_vapix_position("Error: no PTZ on this channel\r\nhelp\r\n", &position, &error));
  EXPECT_EQ(error, "the camera answers 'Error: no PTZ on this channel'");
}

struct Answer {
  const char* name;
  const char* body;
  const char* says;
};

void PrintTo(const Answer& answer, std::ostream* out) { *out << answer.name; }

class UnusableVapixAnswer : public ::testing::TestWithParam<Answer> {};

TEST_P(UnusableVapixAnswer, IsAnErrorOfOneLineAndLeavesThePositionAlone) {
  VapixPosition position;
  position.pan_rad = 7;
  std::string error;
  EXPECT_FALSE(parse_vapix_position(GetParam().body, &position, &error));
  EXPECT_THAT(error, AllOf(HasSubstr(GetParam().says), Not(HasSubstr("\n"))));
  EXPECT_LT(error.size(), 200U);
  EXPECT_EQ(position.pan_rad, 7);
}

INSTANTIATE_TEST_SUITE_P(
    Answers, UnusableVapixAnswer,
    ::testing::Values(
        Answer{"Empty", "", "no pan in the answer ''"},
        Answer{"NoTilt", "pan=1\r\nzoom=1\r\n", "no tilt in the answer 'pan=1'"},
        Answer{"NoPan", "tilt=1\r\n", "no pan"},
        Answer{"Text", "pan=left\r\ntilt=1\r\n", "pan=left"},
        Answer{"EmptyNumber", "pan=\r\ntilt=1\r\n", "'pan=' in the position is not a number"},
        Answer{"DecimalComma", "pan=1,5\r\ntilt=1\r\n", "pan=1,5"},
        Answer{"NotANumber", "pan=nan\r\ntilt=1\r\n", "pan=nan"},
        Answer{"Infinite", "pan=1\r\ntilt=inf\r\n", "tilt=inf"},
        Answer{"ZoomIsText", "pan=1\r\ntilt=1\r\nzoom=far\r\n", "zoom=far"},
        Answer{"PanBeyondATurn", "pan=360.1\r\ntilt=1\r\n", "pan is outside -360..360 degrees"},
        Answer{"TiltBeyondATurn", "pan=1\r\ntilt=-1e9\r\n", "tilt is outside"},
        Answer{"FarBeyondATurn", "pan=1e300\r\ntilt=1\r\n", "-360..360 degrees: 1e+300"},
        Answer{"WebPage",
               "<html>\x01\xff<body>a very long page, a very long page, a very long "
               "page, a very long page, a very long page</body></html>\n",
               "'<html>\\x01\\xff<body>"}),
    [](const auto& answer) { return answer.param.name; });

}  // namespace
}  // namespace alidade

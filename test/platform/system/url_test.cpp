#include "platform/system/url.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Url, KeepsThePasswordApartFromWhatIsShown) {
  Url url;
  std::string error;
  ASSERT_TRUE(parse_url("rtsp://user:p%40ss%3A@camera:8554/a/b?x=1", &url, &error)) << error;
  EXPECT_EQ(url.scheme, "rtsp");
  EXPECT_EQ(url.host, "camera");
  EXPECT_EQ(url.port, "8554");
  EXPECT_EQ(url.path, "/a/b?x=1");
  EXPECT_EQ(url.user, "user");
  EXPECT_EQ(url.password, "p@ss:");
  EXPECT_EQ(url.bare, "rtsp://camera:8554/a/b?x=1");
}

TEST(Url, ShowsNoPasswordOfAUrlItCannotParse) {
  Url url;
  std::string error;
  EXPECT_FALSE(parse_url("rtsp://user:se@cret@camera/x", &url, &error));
  EXPECT_EQ(url.bare, "rtsp://...");
  EXPECT_THAT(error, Not(HasSubstr("cret")));
  EXPECT_FALSE(parse_url("user:se@cret@camera/x", &url, &error));
  EXPECT_EQ(url.bare, "...@camera/x");
  EXPECT_FALSE(parse_url("/dev/ttyUSB0", &url, &error));
  EXPECT_EQ(url.bare, "/dev/ttyUSB0");
}

TEST(Url, RefusesAnAddressWhoseZoneLooksLikeAUser) {
  Url url;
  std::string error;
  EXPECT_TRUE(parse_url("rtsp://user:se@[fe80::1%25eth0]:554/x", &url, &error)) << error;
  EXPECT_EQ(url.user, "user");
  EXPECT_FALSE(parse_url("rtsp://ev@[0::%ev@[0::%00]:4/", &url, &error));
  EXPECT_EQ(url.bare, "rtsp://...");
}

TEST(Url, ShowsAUrlItCannotParseOnOneLine) {
  Url url;
  std::string error;
  EXPECT_FALSE(parse_url("cam\nera\x1b[2J", &url, &error));
  EXPECT_EQ(url.bare, "cam\\nera\\x1b[2J");
}

TEST(Url, IsByTlsAsItsSchemeSays) {
  for (const char* by_tls : {"https://camera", "rtsps://camera/x", "mqtts://broker", "https"}) {
    EXPECT_TRUE(is_by_tls(by_tls)) << by_tls;
  }
  for (const char* plain : {"http://camera", "rtsp://https://x", "mqtt://broker", "s", "", "wss"}) {
    EXPECT_FALSE(is_by_tls(plain)) << plain;
  }
}

}  // namespace
}  // namespace alidade

#include "platform/system/url.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

namespace alidade {
namespace {

using ::testing::AllOf;
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

// As cameras and SRT take them: in the query, or in place of a path.
TEST(Url, ShowsNoSecretOfAQuery) {
  const std::pair<const char*, const char*> cases[] = {
      {"srt://h:9000?passphrase=hidden&latency=20", "passphrase=***&latency=20"},
      {"http://h/video.cgi?loginuse=hidden&loginpas=hidden", "loginuse=***&loginpas=***"},
      {"rtsp://h:554/live?channel=1&user=hidden&pwd=hidden#x", "?channel=1&user=***&pwd=***#x"},
      {"rtsp://h/user=hidden_password=hidden_channel=1", "/user=***"},
      {"rtsp://h/channel=1_password=hidden&stream=0.sdp", "/channel=1_password=***&stream=0.sdp"},
      {"http://h/x?API-Key=hidden;size=4", "?API-Key=***;size=4"},
      {"http://h/x?access_token=hidden=hidden", "?access_token=***"},
      {"http://h/x?p%61ss=hidden", "?p%61ss=***"},
      {"http://h/x?token=ab/hidden&size=4", "?token=***&size=4"},
      {"http://h/x?token=ab?hidden#y/z", "?token=***#y/z"},
      {"http://h/x?pw=hidden&size=640x480", "?pw=***&size=640x480"}};
  for (const auto& [text, seen] : cases) {
    Url url;
    std::string error;
    ASSERT_TRUE(parse_url(text, &url, &error)) << text << error;
    EXPECT_THAT(url.shown, AllOf(HasSubstr(seen), Not(HasSubstr("hidden"))));
    EXPECT_THAT(url.bare, HasSubstr("hidden")) << "the camera needs it";
    EXPECT_THAT(shown_url(text), Not(HasSubstr("hidden")));
  }
  Url url;
  std::string error;
  ASSERT_TRUE(parse_url("rtsp://h/a?x=1&y=2", &url, &error));
  EXPECT_EQ(url.shown, url.bare);
  EXPECT_FALSE(parse_url("a@h/x?pwd=hidden", &url, &error));
  EXPECT_THAT(url.shown + url.bare + error, Not(HasSubstr("hidden")));
  EXPECT_THAT(shown_url("rtsp://admin:hid@den@h/x"),
              AllOf(HasSubstr("rtsp://"), Not(HasSubstr("hid"))));
  EXPECT_THAT(shown_url("http://admin:hidden@h/x"), HasSubstr("http://h/x"));
  EXPECT_EQ(shown_url("/onvif/ptz"), "/onvif/ptz");
  EXPECT_EQ(shown_url("http://h:80"), "http://h:80") << "as it is written";
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

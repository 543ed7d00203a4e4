// A configuration as text: read again, it holds what was set, whatever bytes a device sent.

#include "edge_app/setup/config_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "edge_app/config/config.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

TEST(ConfigText, IsReadAsItWasSet) {
  ConfigText text;
  text.set("video", "type", "rtsp");
  text.set_text("video", "url", "rtsp://192.0.2.10/a?b=\"c\"#d: {e}");
  text.set_text("video", "user", "o'neil: \\ \"x\"");
  text.set("pan_tilt", "type", "onvif");
  text.set_text("pan_tilt", "url", "http://192.0.2.10");
  text.set_text("pan_tilt", "profile", "turning&1\n\x1b[2J");
  std::string error;
  ASSERT_TRUE(text.set_by_word("pan_tilt.pan_range_deg=[-180, 180]", &error)) << error;
  ASSERT_TRUE(text.set_by_word("pan_tilt.tilt_range_deg=[-90, 90]", &error)) << error;
  ASSERT_TRUE(text.set_by_word("video.transport=udp", &error)) << error;
  ASSERT_TRUE(text.set_by_word("camera.focal_length_px=1", &error)) << error;
  ASSERT_TRUE(text.set_by_word("camera.focal_length_px=2500", &error)) << error;  // replaced
  Config config;
  ASSERT_TRUE(parse_config(text.text({"a comment"}), "camera.yaml", &config, &error)) << error;
  EXPECT_EQ(config.video.url, "rtsp://192.0.2.10/a?b=\"c\"#d: {e}");
  EXPECT_EQ(config.video.user, "o'neil: \\ \"x\"");
  EXPECT_EQ(config.video.transport, VideoConfig::Transport::kUdp);
  EXPECT_EQ(config.pan_tilt.profile, "turning&1\n\x1b[2J");
  ASSERT_TRUE(config.pan_tilt.pan_range_deg);
  EXPECT_EQ(config.camera.focal_length_px, 2500);
}

TEST(ConfigText, RefusesAWordThatSetsNothing) {
  for (const char* word : {"", "video", "video.url", "=", "video.=1", ".url=1",
                           "video.url=", "Video.url=1", "a.b\n=c", "a.b=c\nd: e"}) {
    ConfigText text;
    std::string error;
    EXPECT_FALSE(text.set_by_word(word, &error)) << word;
    EXPECT_THAT(error, HasSubstr("expected SECTION.KEY=VALUE")) << word;
  }
}

TEST(FocalLength, FollowsFromTheFieldOfView) {
  std::string value;
  std::string error;
  ASSERT_TRUE(focal_length_of("90", 2000, &value, &error)) << error;
  EXPECT_EQ(value, "1000");
  ASSERT_TRUE(focal_length_of("3.4", 1280, &value, &error)) << error;
  EXPECT_EQ(value, "21564");
  ASSERT_TRUE(focal_length_of("62:2.3", 1920, &value, &error)) << error;
  EXPECT_EQ(value, "{wide: 1598, tele: 47823}");
}

TEST(FocalLength, RefusesWhatIsNoField) {
  std::string value;
  std::string error;
  for (const char* text : {"", "0", "-3", "180", "nan", "1e9", "a", "3:", ":3", "2:60", "3:3"}) {
    EXPECT_FALSE(focal_length_of(text, 1280, &value, &error)) << text;
    EXPECT_THAT(error, HasSubstr("horizontal field of view")) << text;
  }
}

}  // namespace
}  // namespace alidade

#include "platform/video/session_description.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

TEST(SessionDescription, TellsOfTheFirstVideo) {
  const auto video = find_video(
      "v=0\r\nc=IN IP4 239.1.2.3\r\na=control:*\r\nm=audio 5000 RTP/AVP 0\r\n"
      "m=video 5004 RTP/AVP 26\r\na=control:track1\r\nm=video 5006 RTP/AVP 26\r\n");
  ASSERT_TRUE(video);
  EXPECT_EQ(video->address, "239.1.2.3");
  EXPECT_EQ(video->port, 5004);
  EXPECT_EQ(video->control, "track1");
  EXPECT_EQ(video->session_control, "*");
}

TEST(SessionDescription, TellsOfTheSource) {
  const std::string video = "v=0\nm=video 5004 RTP/AVP 26\n";
  EXPECT_EQ(find_video(video)->source, std::nullopt);
  EXPECT_EQ(find_video(video + "a=ssrc:4294967295 cname:x\na=ssrc:7 cname:x\n")->source,
            4294967295U);
  EXPECT_EQ(find_video(video + "a=ssrc:4294967296 cname:x\n")->source, std::nullopt);
  EXPECT_EQ(find_video(video + "a=ssrc:x\n")->source, std::nullopt);
}

TEST(SessionDescription, TellsOfNoVideoOnAPortThatThereIsNot) {
  EXPECT_TRUE(find_video("v=0\nm=video 65535 RTP/AVP 26\n"));
  EXPECT_FALSE(find_video("v=0\nm=video 65536 RTP/AVP 26\n"));
  EXPECT_FALSE(find_video("v=0\nm=video 99999999999 RTP/AVP 26\n"));
}

}  // namespace
}  // namespace alidade

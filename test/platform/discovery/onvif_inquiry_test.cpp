// What an ONVIF device says of itself: its answers taken apart, and a whole device asked.

#include "platform/discovery/onvif_inquiry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "platform/discovery/onvif_media.h"
#include "test/simulator/servers/onvif_server.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string soap_body(const std::string& content) {
  return "<e:Envelope xmlns:e=\"http://www.w3.org/2003/05/soap-envelope\"><e:Body>" + content +
         "</e:Body></e:Envelope>";
}

// As a Hikvision and a Dahua device have it, by media.
TEST(OnvifMedia, ReadsTheStreamsOfMedia) {
  const std::string text = soap_body(
      "<trt:GetProfilesResponse>"
      "<trt:Profiles token=\"Profile_1\" fixed=\"true\"><tt:Name>mainStream</tt:Name>"
      "<tt:VideoSourceConfiguration token=\"v\"/>"
      "<tt:VideoEncoderConfiguration token=\"VideoEncoderToken_1\" encoding=\"H264\">"
      "<tt:Name>VideoEncoder_1</tt:Name><tt:UseCount>1</tt:UseCount><tt:Encoding>H264</tt:Encoding>"
      "<tt:Resolution><tt:Width>2688</tt:Width><tt:Height>1520</tt:Height></tt:Resolution>"
      "<tt:Quality>3</tt:Quality><tt:RateControl><tt:FrameRateLimit>20</tt:FrameRateLimit>"
      "<tt:EncodingInterval>1</tt:EncodingInterval><tt:BitrateLimit>6144</tt:BitrateLimit>"
      "</tt:RateControl><tt:H264><tt:GovLength>50</tt:GovLength><tt:H264Profile>Main"
      "</tt:H264Profile></tt:H264></tt:VideoEncoderConfiguration>"
      "<tt:PTZConfiguration token=\"PTZToken\"/></trt:Profiles>"
      "<trt:Profiles token=\"Profile_2\"><tt:Name>subStream</tt:Name>"
      "<tt:VideoEncoderConfiguration token=\"VideoEncoderToken_2\"><tt:Encoding>JPEG</tt:Encoding>"
      "<tt:Resolution><tt:Width>640</tt:Width><tt:Height>480</tt:Height></tt:Resolution>"
      "<tt:RateControl><tt:FrameRateLimit>20</tt:FrameRateLimit><tt:EncodingInterval>4"
      "</tt:EncodingInterval></tt:RateControl></tt:VideoEncoderConfiguration></trt:Profiles>"
      "<trt:Profiles token=\"audio\"><tt:Name>a</tt:Name></trt:Profiles>"
      "</trt:GetProfilesResponse>");
  std::vector<VideoStream> streams;
  std::string error;
  ASSERT_TRUE(parse_onvif_streams(text, &streams, &error)) << error;
  ASSERT_THAT(streams, SizeIs(2));
  EXPECT_EQ(streams[0].token, "Profile_1");
  EXPECT_EQ(streams[0].name, "mainStream");
  EXPECT_EQ(streams[0].codec, "H264");
  EXPECT_EQ(streams[0].codec_profile, "Main");
  EXPECT_EQ(streams[0].width, 2688);
  EXPECT_EQ(streams[0].height, 1520);
  EXPECT_EQ(streams[0].rate_hz, 20);
  EXPECT_EQ(streams[0].key_frame_distance, 50);
  EXPECT_EQ(streams[0].b_frames, VideoStream::BFrames::kPossible);
  EXPECT_TRUE(streams[0].has_pan_tilt);
  EXPECT_EQ(streams[1].codec, "JPEG");
  EXPECT_EQ(streams[1].rate_hz, 5);  // each fourth picture
  EXPECT_EQ(streams[1].key_frame_distance, 1);
  EXPECT_EQ(streams[1].b_frames, VideoStream::BFrames::kNone);
  EXPECT_FALSE(streams[1].has_pan_tilt);
}

TEST(OnvifMedia, ReadsTheStreamsOfMedia2) {
  const std::string text = soap_body(
      "<tr2:GetProfilesResponse><tr2:Profiles token=\"p1\"><tr2:Name>main</tr2:Name>"
      "<tr2:Configurations><tr2:VideoEncoder token=\"e\" GovLength=\"25\" Profile=\"Main\">"
      "<tt:Encoding>H265</tt:Encoding><tt:Resolution><tt:Width>1920</tt:Width><tt:Height>1080"
      "</tt:Height></tt:Resolution><tt:RateControl ConstantBitRate=\"false\">"
      "<tt:FrameRateLimit>25.0</tt:FrameRateLimit></tt:RateControl></tr2:VideoEncoder>"
      "<tr2:PTZ token=\"z\"/></tr2:Configurations></tr2:Profiles></tr2:GetProfilesResponse>");
  std::vector<VideoStream> streams;
  std::string error;
  ASSERT_TRUE(parse_onvif_streams(text, &streams, &error)) << error;
  ASSERT_THAT(streams, SizeIs(1));
  EXPECT_EQ(streams[0].codec, "H265");
  EXPECT_EQ(streams[0].rate_hz, 25);
  EXPECT_EQ(streams[0].key_frame_distance, 25);
  EXPECT_TRUE(streams[0].has_pan_tilt);
}

TEST(OnvifMedia, NonsenseNumbersCountAsNotTold) {
  std::vector<VideoStream> streams;
  std::string error;
  ASSERT_TRUE(parse_onvif_streams(
      soap_body(
          "<GetProfilesResponse><Profiles token=\"p\"><VideoEncoderConfiguration><Encoding>mpeg7"
          "</Encoding><Resolution><Width>-5</Width><Height>1e99</Height></Resolution><RateControl>"
          "<FrameRateLimit>nan</FrameRateLimit></RateControl></VideoEncoderConfiguration>"
          "</Profiles></GetProfilesResponse>"),
      &streams, &error))
      << error;
  EXPECT_EQ(streams[0].width, 0);
  EXPECT_EQ(streams[0].height, 0);
  EXPECT_EQ(streams[0].rate_hz, 0);
  EXPECT_EQ(streams[0].codec, "mpeg7");
  EXPECT_EQ(streams[0].b_frames, VideoStream::BFrames::kUnknown);
}

TEST(OnvifMedia, RefusesWhatIsNoAnswer) {
  std::vector<VideoStream> streams;
  DeviceReport report;
  std::string url;
  std::string error;
  for (const char* text : {"", "<html>", "<a/>"}) {
    EXPECT_FALSE(parse_onvif_streams(text, &streams, &error));
    EXPECT_THAT(error, HasSubstr("is it an ONVIF service?"));
    EXPECT_FALSE(parse_onvif_device(text, &report, &error));
    EXPECT_FALSE(parse_onvif_stream_url(text, &url, &error));
    EXPECT_THAT(parse_onvif_media2(text), IsEmpty());
  }
  EXPECT_FALSE(parse_onvif_streams(soap_body("<GetProfilesResponse/>"), &streams, &error));
  EXPECT_THAT(error, HasSubstr("video encoder"));
  EXPECT_FALSE(parse_onvif_stream_url(
      soap_body("<GetStreamUriResponse><MediaUri><Uri/></MediaUri></GetStreamUriResponse>"), &url,
      &error));
}

TEST(StreamUrl, IsThatOfTheDevicesOwnHost) {
  bool moved = false;
  EXPECT_EQ(usable_stream_url("rtsp://192.168.0.90:8554/a?b=c", "192.168.0.90", &moved),
            "rtsp://192.168.0.90:8554/a?b=c");
  EXPECT_FALSE(moved);
  EXPECT_EQ(usable_stream_url("rtsp://user:word@10.0.0.1/a", "192.168.0.90", &moved),
            "rtsp://192.168.0.90/a");
  EXPECT_TRUE(moved);
  EXPECT_EQ(usable_stream_url("http://192.168.0.90/a", "192.168.0.90", &moved), "");
  EXPECT_EQ(usable_stream_url("nonsense", "192.168.0.90", &moved), "");
}

OnvifDevice device_with_video() {
  OnvifDevice device;
  device.announced_host = "";
  device.stream_url = "rtsp://10.9.8.7:8554/main";
  device.gov_length = 100;
  return device;
}

TEST(OnvifInquiry, AsksADeviceForAllOfIt) {
  OnvifServer server(device_with_video());
  const DeviceReport report = inquire_onvif(server.url(), {});
  EXPECT_THAT(report.error, IsEmpty());
  EXPECT_EQ(report.maker, "Alidade");
  EXPECT_EQ(report.model, "Virtual PTZ");
  EXPECT_EQ(report.has_pan_tilt, true);
  ASSERT_THAT(report.streams, SizeIs(1));
  EXPECT_EQ(report.streams[0].url, "rtsp://127.0.0.1:8554/main");
  EXPECT_EQ(report.streams[0].token, "turning&1");
  EXPECT_EQ(report.streams[0].key_frame_distance, 100);
  EXPECT_EQ(report.streams[0].b_frames, VideoStream::BFrames::kNone);
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("at another address")));
}

TEST(OnvifInquiry, TakesMedia2WhereTheDeviceHasIt) {
  OnvifDevice device = device_with_video();
  device.media2_path = "/onvif/media2";
  device.encoding = "H265";
  device.encoder_profile = "Main";
  OnvifServer server(device);
  const DeviceReport report = inquire_onvif(server.url(), {});
  EXPECT_THAT(report.error, IsEmpty());
  ASSERT_THAT(report.streams, SizeIs(1));
  EXPECT_EQ(report.streams[0].codec, "H265");
  EXPECT_EQ(report.streams[0].url, "rtsp://127.0.0.1:8554/main");
}

TEST(OnvifInquiry, LogsInOnlyWhenItIsToldTo) {
  for (const auto login : {OnvifDevice::Login::kToken, OnvifDevice::Login::kDigestMd5}) {
    OnvifDevice device = device_with_video();
    device.login = login;
    OnvifServer server(device);
    server.clock_offset_s = login == OnvifDevice::Login::kToken ? 7200 : 0;
    const DeviceReport stranger = inquire_onvif(server.url(), {});
    EXPECT_TRUE(stranger.wants_login);
    EXPECT_THAT(stranger.error, HasSubstr("wants a user and a password"));
    EXPECT_EQ(server.wrong_logins, 0);
    DeviceLogin known;
    known.user = device.user;
    known.password = device.password;
    const DeviceReport report = inquire_onvif(server.url(), known);
    EXPECT_THAT(report.error, IsEmpty());
    EXPECT_THAT(report.streams, SizeIs(1));
    EXPECT_EQ(server.wrong_logins, 0);
    known.password = "guessed";
    const DeviceReport wrong = inquire_onvif(server.url(), known);
    EXPECT_TRUE(wrong.wants_login);
    EXPECT_THAT(wrong.error, HasSubstr("wrong user or password"));
    EXPECT_THAT(wrong.error, ::testing::Not(HasSubstr("guessed")));
    EXPECT_LE(server.wrong_logins, 3);  // devices lock a user out
  }
}

TEST(OnvifInquiry, SaysWhenNobodyAnswers) {
  std::string url;
  {
    OnvifServer server(device_with_video());
    url = server.url();
  }
  const DeviceReport report = inquire_onvif(url, {});
  EXPECT_THAT(report.error, ::testing::Not(IsEmpty()));
  EXPECT_FALSE(report.wants_login);
}

TEST(OnvifInquiry, SaysWhenItIsNoOnvifDevice) {
  LoopbackHttpServer server;
  server.handlers().Post(".*", [](const httplib::Request&, httplib::Response& response) {
    response.set_content("<html>router</html>", "text/html");
  });
  server.listen(0);
  EXPECT_THAT(inquire_onvif(server.url(), {}).error, HasSubstr("no answer of an ONVIF device"));
}

// An answer without end is cut off.
TEST(OnvifInquiry, AFloodIsRefused) {
  LoopbackHttpServer server;
  server.handlers().Post(".*", [](const httplib::Request&, httplib::Response& response) {
    response.set_content(std::string(std::size_t{4} << 20, 'x'), "text/xml");
  });
  server.listen(0);
  EXPECT_THAT(inquire_onvif(server.url(), {}).error, HasSubstr("longer than it can be"));
}

}  // namespace
}  // namespace alidade

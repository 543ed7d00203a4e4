// What an Axis device says of itself.

#include "platform/discovery/vapix_inquiry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "platform/discovery/vapix_parameters.h"
#include "test/simulator/servers/digest_check.h"
#include "test/simulator/servers/loopback_http_server.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::string kParameters =
    "root.Brand.Brand=AXIS\r\nroot.Brand.ProdFullName=AXIS Q6075-E PTZ Dome Network Camera\r\n"
    "root.Properties.Firmware.Version=10.12.208\r\n"
    "root.Properties.Image.Format=jpeg,mjpeg,h264,h265\r\n"
    "root.Properties.Image.Resolution=3840x2160,1920x1080,1280x720\r\n"
    "root.Properties.PTZ.PTZ=yes\r\nroot.Network.RTSP.Port=554\r\n"
    "root.Image.I0.Enabled=yes\r\nroot.Image.I0.Name=View Area 1\r\n"
    "root.Image.I0.Appearance.Resolution=1920x1080\r\nroot.Image.I0.MPEG.PCount=31\r\n"
    "root.Image.I0.MPEG.ZGopMode=fixed\r\nroot.Image.I0.MPEG.H264.Profile=high\r\n"
    "root.Image.I0.Stream.FPS=0\r\n";

DeviceReport report_of(const std::string& text, std::string* error) {
  DeviceReport report;
  error->clear();
  EXPECT_EQ(parse_vapix_parameters(text, "192.168.0.90", &report, error), error->empty());
  return report;
}

TEST(VapixParameters, ReadsADome) {
  std::string error;
  const DeviceReport report = report_of(kParameters, &error);
  EXPECT_EQ(report.maker, "AXIS");
  EXPECT_EQ(report.model, "AXIS Q6075-E PTZ Dome Network Camera");
  EXPECT_EQ(report.firmware, "10.12.208");
  EXPECT_EQ(report.has_pan_tilt, true);
  ASSERT_THAT(report.streams, SizeIs(3)) << error;
  EXPECT_EQ(report.streams[0].codec, "H264");
  EXPECT_EQ(report.streams[0].codec_profile, "high");
  EXPECT_EQ(report.streams[0].key_frame_distance, 32);
  EXPECT_EQ(report.streams[0].b_frames, VideoStream::BFrames::kUnknown);
  EXPECT_EQ(report.streams[0].rate_hz, 0);
  EXPECT_EQ(report.streams[0].url,
            "rtsp://192.168.0.90/axis-media/media.amp?videocodec=h264&resolution=1920x1080");
  EXPECT_EQ(report.streams[2].codec, "JPEG");
  EXPECT_THAT(report.notes, IsEmpty());
}

TEST(VapixParameters, OffersASmallerSizeOfALargePictureAndNamesTheChannel) {
  std::string error;
  std::string text = kParameters;
  text.replace(text.find("Resolution=1920x1080\r\nroot.Image.I0.MPEG"), 20, "Resolution=3840x2160");
  text.replace(text.find("ZGopMode=fixed"), 14, "ZGopMode=dynamic");
  text.replace(text.find("Port=554"), 8, "Port=555");
  text += "root.Image.I1.Appearance.Resolution=640x480\r\nroot.Image.I1.Enabled=no\r\n";
  const DeviceReport report = report_of(text, &error);
  ASSERT_THAT(report.streams, SizeIs(6)) << error;
  EXPECT_EQ(report.streams[1].url,
            "rtsp://192.168.0.90:555/axis-media/media.amp?videocodec=h264&resolution=1920x1080"
            "&camera=1");
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("Zipstream")));
}

TEST(VapixParameters, RefusesWhatIsNoList) {
  std::string error;
  report_of("", &error);
  EXPECT_THAT(error, HasSubstr("is it an Axis device?"));
  report_of("# Error: Error -1 getting param in group 'root.Image'\r\n", &error);
  EXPECT_THAT(error, HasSubstr("is it an Axis device?"));
  report_of("root.Brand.Brand=AXIS\n", &error);
  EXPECT_THAT(error, HasSubstr("no size"));
  report_of(
      "root.Image.I0.Appearance.Resolution=99999999999x-3\nroot.Properties.Image.Format=h264\n",
      &error);
  EXPECT_THAT(error, HasSubstr("no size"));
}

TEST(VapixInquiry, LogsInByDigestAndSaysWhatIsWrong) {
  DigestCheck digest("viewer", "right horse", DigestCheck::Algorithm::kMd5);
  LoopbackHttpServer server;
  server.handlers().Get(
      "/axis-cgi/param.cgi", [&](const httplib::Request& request, httplib::Response& response) {
        if (!digest.accepts("GET", request.target, request.get_header_value("Authorization"))) {
          response.set_header("WWW-Authenticate", digest.challenge());
          response.status = 401;
          return;
        }
        response.set_content(kParameters, "text/plain");
      });
  server.listen(0);
  const DeviceReport stranger = inquire_vapix(server.url(), {});
  EXPECT_TRUE(stranger.wants_login);
  EXPECT_THAT(stranger.error, HasSubstr("wants a user and a password"));
  DeviceLogin login;
  login.user = "viewer";
  login.password = "wrong mule";
  EXPECT_THAT(inquire_vapix(server.url(), login).error, HasSubstr("wrong user or password"));
  login.password = "right horse";
  const DeviceReport report = inquire_vapix(server.url(), login);
  EXPECT_THAT(report.error, IsEmpty());
  EXPECT_THAT(report.streams, SizeIs(3));
}

TEST(VapixInquiry, SaysWhenItIsNoAxisDevice) {
  LoopbackHttpServer server;
  server.listen(0);
  const DeviceReport report = inquire_vapix(server.url(), {});
  EXPECT_THAT(report.error, HasSubstr("404"));
  EXPECT_FALSE(report.wants_login);
}

}  // namespace
}  // namespace alidade

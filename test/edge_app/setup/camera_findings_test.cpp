// What is printed of what was found.

#include "edge_app/setup/camera_findings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

CameraFindings findings_of_one() {
  FoundCamera camera;
  camera.device.host = "192.0.2.10";
  camera.device.onvif_url = "http://192.0.2.10/onvif/device_service";
  camera.device.interface = "eth0";
  camera.report.maker = "Maker";
  camera.report.model = "Dome\x1b[2J";
  VideoStream stream;
  stream.url = "rtsp://192.0.2.10/s?user=admin&password=secret";
  stream.codec = "H264";
  stream.codec_profile = "High";
  stream.b_frames = VideoStream::BFrames::kPossible;
  stream.width = 1920;
  stream.height = 1080;
  stream.key_frame_distance = 50;
  camera.report.streams = {stream};
  camera.choice = choose_stream(camera.report.streams);
  camera.telemetry.type = "onvif";
  camera.telemetry.asked = true;
  camera.telemetry.pan_deg = 12.5;
  camera.telemetry.tilt_deg = -3.25;
  CameraFindings findings;
  findings.cameras = {camera};
  return findings;
}

TEST(CameraFindings, AreEscapedAndShowNoSecret) {
  const std::string text = text_of_findings(findings_of_one());
  EXPECT_THAT(text, HasSubstr("192.0.2.10     Maker Dome\\x1b[2J\n"));
  EXPECT_THAT(text, HasSubstr("take         1920x1080 H264 High, rate not told, key frame each 50 "
                              "pictures, B-frames possible\n"));
  EXPECT_THAT(text, HasSubstr("telemetry    onvif answers: pan 12.50 deg, tilt -3.25 deg\n"));
  EXPECT_THAT(text, Not(HasSubstr("secret")));
}

TEST(CameraFindings, AsJsonTellWhatIsNotToldByNull) {
  const auto json = json_of_findings(findings_of_one());
  const auto& camera = json["cameras"][0];
  EXPECT_EQ(camera["take"], 0);
  EXPECT_TRUE(camera["vapix"].is_null());
  EXPECT_TRUE(camera["streams"][0]["rate_hz"].is_null());
  EXPECT_EQ(camera["streams"][0]["b_frames"], true);
  EXPECT_THAT(camera["streams"][0]["url"], Not(HasSubstr("secret")));
  EXPECT_EQ(camera["telemetry"]["pan_deg"], 12.5);
  EXPECT_TRUE(json["video_devices"].empty());
}

TEST(CameraFindings, NameADeviceByWhatIsKnown) {
  FoundCamera camera;
  EXPECT_EQ(name_of(camera), "a camera without a name");
  camera.device.hardware = "DS-2CD2143G0-I";
  EXPECT_EQ(name_of(camera), "DS-2CD2143G0-I");
  camera.device.name = "HIKVISION DS-2CD2143G0-I";
  EXPECT_EQ(name_of(camera), "HIKVISION DS-2CD2143G0-I");
  camera.report.model = "AXIS Q6075-E";
  camera.report.maker = "AXIS";
  EXPECT_EQ(name_of(camera), "AXIS Q6075-E");
  camera.report.maker = "Dahua";
  EXPECT_EQ(name_of(camera), "Dahua AXIS Q6075-E");
}

TEST(CameraFindings, SayThatTelemetryWasNotAsked) {
  CameraFindings findings = findings_of_one();
  findings.cameras[0].telemetry.asked = false;
  EXPECT_THAT(text_of_findings(findings), HasSubstr("onvif, not asked: it wants a login"));
  findings.cameras[0].telemetry.type = "";
  findings.cameras[0].report.has_pan_tilt = false;
  EXPECT_THAT(text_of_findings(findings), HasSubstr("none: the device has no pan and tilt"));
}

}  // namespace
}  // namespace alidade

// The built executable with a camera that speaks HTTP only: MJPEG for the video, ONVIF for pan and tilt.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "test/edge_app/commands/alidade_command.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/simulator/servers/onvif_server.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

class HttpLinks : public ::testing::Test {
 protected:
  explicit HttpLinks(const MjpegStyle& style = style_at_another_pace())
      : video_(style, MjpegServer::Login::kDigestSha256) {
    ::setenv("ALIDADE_TEST_VIDEO_PASSWORD", MjpegServer::kPassword, 1);
    ::setenv("ALIDADE_TEST_HEAD_PASSWORD", device_.password.c_str(), 1);
  }

  static OnvifDevice device_with_login() {
    OnvifDevice device;
    device.login = OnvifDevice::Login::kToken;
    return device;
  }

  // Pictures come faster than their time stamps say.
  static MjpegStyle style_at_another_pace() {
    MjpegStyle style;
    style.timestamp_step_s = 0.04;
    return style;
  }

  std::string config(
      const std::string& ranges = "pan_range_deg: [-180, 180], tilt_range_deg: [-90, 90],") {
    return directory_.write(
        "alidade.yaml",
        "video: {type: mjpeg, url: '" + video_.url() + "', user: '" + MjpegServer::kUser +
            "', password_env: ALIDADE_TEST_VIDEO_PASSWORD, width: 96, height: 64, timeout_s: 30}\n"
            "pan_tilt: {type: onvif, url: '" +
            head_.url() + "', user: '" + device_.user + "', " + ranges +
            " password_env: ALIDADE_TEST_HEAD_PASSWORD, timeout_s: 30}\n"
            "camera: {focal_length_px: 1000}\nrealtime: {mode: PT}\n");
  }

  const OnvifDevice device_ = device_with_login();
  MjpegServer video_;
  OnvifServer head_{device_};
  TemporaryDirectory directory_;
};

TEST_F(HttpLinks, AreMeasuredByCheck) {
  const Result result = alidade({"check", "-c", config(), "--duration", "1"});
  EXPECT_THAT(result.output, AllOf(HasSubstr("96x64 px"), HasSubstr("sender clock"),
                                   HasSubstr("pan 90.0000 deg, tilt -22.5000 deg"),
                                   HasSubstr("decoding"), HasSubstr("the head turned too little"),
                                   HasSubstr("advice         video")));  // all is of one grey
  // The server's images come some milliseconds apart, and claim to be 40 ms apart.
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("time stamps cannot be used"));
}

TEST_F(HttpLinks, RunWarnsThatACalibrationWithoutAFileIsLost) {
  static_cast<void>(config());
  std::string text = directory_.read("alidade.yaml");
  text.replace(text.find("mode: PT"), 8, "mode: OE");
  const auto errors_of = [this, &text](const std::string& more) {
    const std::string file = directory_.write("oe.yaml", text + more);
    const Result result = alidade({"run", "-c", file, "--duration", "0.5"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.errors;
  };
  constexpr const char* kLost = "warning calibration: calibration.file is not set";
  EXPECT_THAT(errors_of(""), HasSubstr(kLost));
  EXPECT_THAT(errors_of("calibration: {file: kept.yaml}\n"), Not(HasSubstr(kLost)));
  EXPECT_THAT(errors_of("calibration: {auto: false}\n"), Not(HasSubstr(kLost)));
}

TEST_F(HttpLinks, SayToCheckWhenTheyBreak) {
  Process process(command({"check", "-c", config(), "--duration", "4"}));
  ASSERT_TRUE(eventually([this] { return head_.count("GetStatus") >= 3; }));
  head_.status = 503;
  EXPECT_THAT(process.read_all(), HasSubstr("pan 90.0000 deg"));
  EXPECT_EQ(process.wait(), 1);
  EXPECT_THAT(process.errors(), HasSubstr("alidade: pan/tilt " + head_.url()));
  EXPECT_THAT(process.errors(),
              HasSubstr("the connection was lost 1 time during the check, last: "));
}

class HttpLinksInTime : public HttpLinks {
 protected:
  HttpLinksInTime() : HttpLinks(style_in_time()) {}

  static MjpegStyle style_in_time() {
    MjpegStyle style;
    style.timestamps_run = true;
    return style;
  }
};

TEST_F(HttpLinksInTime, GiveRecordsToRun) {
  Process process(command({"run", "-c", config(), "--json"}));
  std::string line = process.read_line();
  while (!line.empty() && line.find("\"mode\":\"PT\"") == std::string::npos) {
    line = process.read_line();
  }
  EXPECT_THAT(line, HasSubstr("\"pan_rad\":1.5707963"));
}

TEST_F(HttpLinks, AreRecorded) {
  const std::string recording = directory_.path() + "/recording";
  Result result = alidade({"record", "-c", config(), "-o", recording, "--duration", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  result = alidade({"run", "--csv", "-c",
                    directory_.write("recorded.yaml",
                                     "video: {type: recording, directory: recording}\n"
                                     "pan_tilt: {type: recording, directory: recording}\n"
                                     "camera: {focal_length_px: 1000}\nrealtime: {mode: PT}\n")});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(read_csv(result.output).size(),
            read_csv(directory_.read("recording/frames.csv")).size());
  EXPECT_THAT(result.output, HasSubstr(",PT,"));
  // In OE mode the size of its pictures is the recording's own: video.width and video.height have no place beside it.
  result = alidade({"run", "--csv", "-c",
                    directory_.write("looked_at.yaml",
                                     "video: {type: recording, directory: recording}\n"
                                     "pan_tilt: {type: recording, directory: recording}\n"
                                     "camera: {focal_length_px: 1000}\n")});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(read_csv(result.output).size(),
            read_csv(directory_.read("recording/frames.csv")).size());
  directory_.write("recording/recording.yaml", "format: 1\nwidth: 96\n");
  result = alidade({"run", "-c", directory_.path() + "/looked_at.yaml"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors), AllOf(HasSubstr("recording.yaml"), HasSubstr("height")));
}

// Connected at once, but without a picture for longer than the whole recording is to be: as between two key frames far apart.
TEST_F(HttpLinks, AreRecordedForTheWholeDurationFromTheFirstPictureOn) {
  video_.allowed = 0;
  Process process(command(
      {"record", "-c", config(), "-o", directory_.path() + "/recording", "--duration", "0.3"}));
  const int before = head_.count("GetStatus");
  ASSERT_TRUE(eventually([&] { return head_.count("GetStatus") >= before + 15; }));
  video_.allowed = 1 << 30;
  static_cast<void>(process.read_all());
  EXPECT_EQ(process.wait(), 0) << process.errors();
  EXPECT_THAT(process.errors(), Not(HasSubstr("asked for")));
  const auto frames = read_csv(directory_.read("recording/frames.csv"));
  ASSERT_GT(frames.size(), 2U);
  EXPECT_GT(std::stod(frames.back().at("receive_time_s")) -
                std::stod(frames.front().at("receive_time_s")),
            0.95 * 0.3);
}

TEST_F(HttpLinks, AreSaidToBeRecordedForLessWhereThePicturesStop) {
  video_.allowed = 5;
  const Result result = alidade(
      {"record", "-c", config(), "-o", directory_.path() + "/recording", "--duration", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("are stored of the 1 s asked for, as the video stopped"));
  EXPECT_EQ(read_csv(directory_.read("recording/frames.csv")).size(), 5U);
}

TEST_F(HttpLinks, AreCheckedForTheFoldersThatRunWillWriteTo) {
  directory_.write("taken", "no folder");
  static_cast<void>(config());  // writes alidade.yaml
  const std::string file =
      directory_.write("other.yaml", directory_.read("alidade.yaml") +
                                         "output: {json: false, http: '127.0.0.1:0', "
                                         "recordings: taken/recordings}\n");
  const Result result = alidade({"check", "-c", file, "--duration", "1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("other.yaml: output.recordings: " + directory_.path() +
                                       "/taken/recordings: no file can be made there: "));
  // A bare name, from where it lies: the present folder.
  std::string bare = directory_.read("alidade.yaml");
  bare.replace(bare.find("realtime:"), std::string::npos,
               "calibration: {file: calibration.yaml}\n");
  directory_.write("bare.yaml", bare);
  const fs::path before = fs::current_path();
  fs::current_path(directory_.path());
  EXPECT_THAT(alidade({"check", "-c", "bare.yaml", "--duration", "1"}).errors,
              Not(HasSubstr("no file can be made")));
  fs::current_path(before);
}

TEST_F(HttpLinks, SayInOneLineWhatIsMissing) {
  const Result result = alidade({"check", "-c", config(""), "--duration", "1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr(head_.url()), HasSubstr("pan_range_deg")));
}

}  // namespace
}  // namespace alidade

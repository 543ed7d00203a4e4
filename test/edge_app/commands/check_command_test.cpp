// `alidade check` as a person meets it, on recordings of the virtual camera that are played at their pace: a healthy setup,
// and what goes wrong when one is put together. The virtual camera shares no code with what is tested.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/rtp_relay.h"
#include "test/platform/support/rtp_sender.h"
#include "test/support/temporary_directory.h"
#include "test/support/udp_port_pair.h"
#include "test/support/zoom_by_formula.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

std::string camera_with(const std::string& telemetry) {
  return "seed: 5\n"
         "duration_s: 5\n"
         "image: {width: 320, height: 180, rate_hz: 25}\n"
         "camera: {focal_length_px: 900, line_delay_us: 75, clock_offset_ms: -84.4}\n"
         "path: {type: triple_cosine, amplitude: 1, period_s: 7}\n"
         "scene: {procedural: [{width_deg: 360, height_deg: 180, projection: equirectangular}]}\n"
         "sensor: {exposure_ms: 1, read_noise: 1.5, jpeg_quality: 90}\n"
         "telemetry: {rate_hz: 30, sigma_rad: 5.0e-5" +
         telemetry + "}\n";
}

void film(const TemporaryDirectory& directory, const std::string& telemetry) {
  const std::string file = directory.write("camera.yaml", camera_with(telemetry));
  const Result result = run({ALIDADE_SIMULATE, "-c", file, "-o", directory.path() + "/recording"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
}

class CheckCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    healthy_ = new TemporaryDirectory;
    film(*healthy_, "");
  }
  static void TearDownTestSuite() {
    delete healthy_;
    healthy_ = nullptr;
  }
  // A copy to spoil.
  void take_healthy() {
    fs::copy(healthy_->path() + "/recording", path("recording"), fs::copy_options::recursive);
  }

  [[nodiscard]] std::string path(const std::string& name) const {
    return directory_.path() + "/" + name;
  }

  // Changes each row of telemetry.csv: receive_time_s, pan_rad, tilt_rad and what follows.
  void change_telemetry(const std::function<void(std::vector<std::string>*)>& change) {
    std::istringstream rows(directory_.read("recording/telemetry.csv"));
    std::string line;
    std::getline(rows, line);
    ASSERT_THAT(line, StartsWith("receive_time_s,pan_rad,tilt_rad"));
    std::ostringstream changed;
    changed << line << "\n";
    while (std::getline(rows, line)) {
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      change(&cells);
      for (std::size_t i = 0; i < cells.size(); ++i) changed << (i > 0 ? "," : "") << cells[i];
      changed << "\n";
    }
    std::ofstream(path("recording/telemetry.csv")) << changed.str();
  }

  Result check(const std::string& focal_length_px = "900",
               const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {
        "check", "--duration", "4", "-c",
        directory_.write("alidade.yaml",
                         "video: {type: recording, directory: recording}\n"
                         "pan_tilt: {type: recording, directory: recording, "
                         "angle_sigma_rad: 5.0e-5}\n"
                         "camera: {focal_length_px: " +
                             focal_length_px + "}\n")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return alidade(arguments);
  }

  // Over readings 1000 to 2000; the virtual camera stands at 1625.
  static ZoomCurve curve_of_camera() {
    std::vector<Calibration> nodes;
    for (const double reading : {1000.0, 1250.0, 1500.0, 1750.0, 2000.0}) {
      Calibration c = test::zoom_calibration(reading);
      const double scale = 900 / test::zoom_focal_length(1625);
      c.camera = {scale * c.camera.focal_length, 1, {0}, 320, 180, 0, 0};
      const int f = index(Parameter::kFocalLength);
      c.covariance(f, f) *= scale * scale;
      c.line_delay = 75e-6;
      c.clock_offset = -0.0844;
      nodes.push_back(c);
    }
    ZoomFit fit;
    std::string error;
    EXPECT_TRUE(fit_zoom(nodes, {}, &fit, &error)) << error;
    return fit.curve;
  }
  // Of a camera that tells this zoom, calibrated by that curve.
  Result check_at(double zoom) {
    if (!fs::exists(path("recording"))) take_healthy();
    std::istringstream rows(directory_.read("recording/telemetry.csv"));
    std::ostringstream changed;
    std::string line;
    std::getline(rows, line);
    const std::size_t columns = line.find(",zoom");  // at the end, if any
    changed << line.substr(0, columns) << ",zoom\n";
    while (std::getline(rows, line)) {
      changed << (columns == std::string::npos ? line : line.substr(0, line.rfind(','))) << ','
              << zoom << "\n";
    }
    std::ofstream(path("recording/telemetry.csv")) << changed.str();
    CalibrationNotes notes;
    notes.zoom_curve = curve_of_camera();
    const Calibration first = notes.zoom_curve.node(0);
    std::string error;
    EXPECT_TRUE(save_calibration(path("calibration.yaml"), first, notes, &error)) << error;
    const std::string file = directory_.write(
        "alidade.yaml",
        "video: {type: recording, directory: recording}\n"
        "pan_tilt: {type: recording, directory: recording, angle_sigma_rad: 5.0e-5}\n"
        "calibration: {file: calibration.yaml, auto: false}\n");
    return alidade({"check", "--duration", "1", "-c", file});
  }

  TemporaryDirectory directory_;

 private:
  static TemporaryDirectory* healthy_;
};

TemporaryDirectory* CheckCommand::healthy_ = nullptr;

// What is wrong, below the log: each finding is one line that says where.
std::vector<std::string> findings(const std::string& errors) {
  std::vector<std::string> findings;
  std::istringstream lines(errors);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("alidade: ", 0) == 0) findings.push_back(line);
  }
  return findings;
}

TEST_F(CheckCommand, PassesAHealthySetup) {
  take_healthy();
  const Result result = check();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(findings(result.errors), IsEmpty());
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("320x180 px"), HasSubstr("points to follow"),
                    HasSubstr("while the head turns; 0 of "),
                    HasSubstr("pan sign correct, tilt sign correct; focal length about "),
                    Not(HasSubstr("advice"))));
}

// Longer than a connection is given without a picture.
TEST_F(CheckCommand, WaitsForAKeyFrameForAsLongAsItTakesAndSaysSo) {
  constexpr double kWithout_s = 5.5;
  const int port = test::udp_port_pair();
  std::atomic<bool> over{false};
  std::thread camera([&] {
    ASSERT_TRUE(eventually([port] { return rtp_port_taken(port); }));
    const double begin_s = monotonic_now_s();
    RtpRelay relay(port);
    RtpSender sender(RtpSender::Codec::kH264, relay.port());
    while (!over) {
      const bool key = sender.sent() % 10 == 0;
      sender.send();
      relay.forward([&](RtpRelay::Packets& packets) {
        if (key && monotonic_now_s() < begin_s + kWithout_s) packets.clear();
      });
      std::this_thread::sleep_for(std::chrono::milliseconds(33));  // the camera's pace
    }
  });
  const std::string file = directory_.write(
      "alidade.yaml",
      "video: {type: rtp, url: 'rtp://@:" + std::to_string(port) +
          "', format: H264, timeout_s: 1, width: 160, height: 120}\n" +
          "pan_tilt: {type: vapix, url: 'http://127.0.0.1:1'}\ncamera: {focal_length_px: 900}\n");
  const Result result = alidade({"check", "--duration", "1", "-c", file});
  over = true;
  camera.join();
  EXPECT_THAT(result.errors, HasSubstr("waiting for a key frame since 3 s; set a shorter"));
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("160x120 px"), HasSubstr("advice         rtp://0.0.0.0"),
                    HasSubstr("waiting for a key frame since 5 s")));
}

TEST_F(CheckCommand, TellsProgramsTheSameAsOneLineOfJson) {
  take_healthy();
  change_telemetry([](std::vector<std::string>* cells) {
    (*cells)[2] = std::to_string(-std::stod((*cells)[2]));
  });
  const Result result = check("900", {"--json"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_EQ(result.output.find('\n'), result.output.size() - 1) << result.output;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["configuration"], path("alidade.yaml"));
  EXPECT_EQ(json["calibration"]["focal_length_px"], 900.0);
  EXPECT_EQ(json["video"]["width"], 320);
  EXPECT_NEAR(json["video"]["rate_hz"], 25, 0.5);
  EXPECT_TRUE(json["video"]["error"].is_null());
  EXPECT_GT(json["video"]["pictures"]["points"], 10);
  EXPECT_NEAR(json["pan_tilt"]["rate_hz"], 30, 1);
  EXPECT_EQ(json["motion"]["pan_sign"], "right");
  EXPECT_EQ(json["motion"]["tilt_sign"], "reversed");
  std::vector<std::string> problems;
  for (const auto& finding : json["findings"]) {
    if (finding["severity"] == "problem")
      problems.push_back("alidade: " + finding["text"].get<std::string>());
  }
  EXPECT_EQ(problems, findings(result.errors));
  EXPECT_THAT(problems, ElementsAre(HasSubstr("tilt is reversed")));
}

TEST_F(CheckCommand, SaysThatTiltIsReversed) {
  take_healthy();
  change_telemetry([](std::vector<std::string>* cells) {
    std::string& tilt = cells->at(2);
    tilt = tilt.front() == '-' ? tilt.substr(1) : "-" + tilt;
  });
  const Result result = check();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors),
              ElementsAre(AllOf(HasSubstr(path("recording")), HasSubstr("tilt is reversed"),
                                HasSubstr("invert the sign of tilt_rad"))));
  EXPECT_THAT(result.output, HasSubstr("pan sign correct, tilt sign REVERSED"));
}

// Upside down against the telemetry, too: nothing may be claimed of it.
TEST_F(CheckCommand, JudgesNoSignsWhereTimeStampsCountPictures) {
  take_healthy();
  std::istringstream rows(directory_.read("recording/frames.csv"));
  std::ostringstream counted("frame,receive_time_s,sender_time_s\n", std::ios::ate);
  std::string row;
  std::getline(rows, row);
  for (int i = 0, sent = 0; std::getline(rows, row); ++i) {
    if (i % 6 == 2 || i % 17 == 8) continue;
    const std::size_t frame_and_receipt = row.find(',', row.find(',') + 1);
    counted << row.substr(0, frame_and_receipt) << ',' << 0.04 * ++sent << "\n";
  }
  std::ofstream(path("recording/frames.csv")) << counted.str();
  change_telemetry([](std::vector<std::string>* cells) {
    for (const std::size_t axis : {1U, 2U}) {
      std::string& angle = cells->at(axis);
      angle = angle.front() == '-' ? angle.substr(1) : "-" + angle;
    }
  });
  const Result result = check();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors), ElementsAre(HasSubstr("its time stamps count pictures")));
  EXPECT_THAT(
      result.output,
      HasSubstr("motion       signs are not judged: the camera's time stamps count pictures"));
}

TEST_F(CheckCommand, SaysHowLongADeviceRepeatsOldAngles) {
  film(directory_, ", internal_rate_hz: 5");
  const Result result = check();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors),
              ElementsAre(AllOf(HasSubstr("repeats an old angle for up to "),
                                HasSubstr("set max_repeat_s: 0.2"))));
  EXPECT_THAT(result.output, HasSubstr("changes      5.0 a second"));
}

TEST_F(CheckCommand, SaysThatADeviceNeverMeasures) {
  take_healthy();
  change_telemetry([](std::vector<std::string>* cells) { cells->at(1) = cells->at(2) = "0.1"; });
  const Result result = check();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors), ElementsAre(HasSubstr("the angles never change")));
}

TEST_F(CheckCommand, SaysThatTheFocalLengthIsAnother) {
  take_healthy();
  const Result result = check("3000");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors),
              ElementsAre(AllOf(StartsWith("alidade: camera.focal_length_px: "),
                                HasSubstr("set camera.focal_length_px: 9"))));
}

TEST_F(CheckCommand, InsideTheZoomCurveIsNoOtherZoom) {
  const Result inside = check_at(1625);
  EXPECT_EQ(inside.exit_code, 0);
  EXPECT_THAT(findings(inside.errors), IsEmpty());
  EXPECT_THAT(inside.output, AllOf(HasSubstr("1625, unchanged; within the zoom curve; f is "),
                                   HasSubstr("between its zooms")));
  Calibration there;
  ASSERT_TRUE(curve_of_camera().at(1625, &there));
  EXPECT_THAT(inside.output, HasSubstr(fmt::format("f is {:.1f} +- ", there.camera.focal_length)));
  EXPECT_THAT(check_at(2100).output, AllOf(HasSubstr("2100, unchanged; beyond the zooms of the "
                                                     "curve; f is "),
                                           HasSubstr("beyond its zooms")));
  const Result outside = check_at(4000);
  EXPECT_EQ(outside.exit_code, 1);
  EXPECT_THAT(outside.errors,
              HasSubstr("the zoom is 4000, but the calibration is for readings 0 to 3000, by the "
                        "zoom curve of "));
}

TEST_F(CheckCommand, TellsALinkThatIsDead) {
  const Result result = alidade({"check", "--duration", "1", "-c",
                                 directory_.write("alidade.yaml",
                                                  "video: {type: recording, directory: gone}\n"
                                                  "pan_tilt: {type: recording, directory: lost}\n"
                                                  "camera: {focal_length_px: 900}\n")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(findings(result.errors),
              ElementsAre(HasSubstr(path("gone")), HasSubstr(path("lost"))));
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("video "), HasSubstr(": failed"), HasSubstr("pan/tilt ")));
}

TEST_F(CheckCommand, RefusesAConfigurationThatIsWrong) {
  const Result result =
      alidade({"check", "-c",
               directory_.write("alidade.yaml",
                                "video: {type: recording, directory: recording}\n"
                                "pan_tilt: {type: recording, directory: recording, rate_hz: fast}\n"
                                "camera: {focal_length_px: 900}\n")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("alidade.yaml:2: "));
  EXPECT_THAT(result.output, IsEmpty());
}

}  // namespace
}  // namespace alidade

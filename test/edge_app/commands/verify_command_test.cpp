// `alidade verify` on pictures that the virtual camera rendered: with the true calibration, with
// wrong ones, and where nothing can be judged.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/realtime/frame_orientation.h"
#include "edge_app/storage/calibration_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/commands/filmed_recording.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

class VerifyTest : public ::testing::Test {
 protected:
  static std::string recording() { return filmed_recording().path() + "/recording"; }

  // The true calibration's file with one value of it replaced.
  std::string changed(const std::string& from, const std::string& to) {
    std::string text = filmed_recording().read("recording/truth.yaml");
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << text;
    return directory_.write("changed.yaml", text.replace(at, from.size(), to));
  }

  Result verify(const std::string& recording, const std::string& calibration,
                const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"verify", recording, "-o", directory_.path() + "/out"};
    if (!calibration.empty()) {
      arguments.emplace_back("--calibration");
      arguments.push_back(calibration);
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return alidade(arguments);
  }

  // Where pixels of the frames look, by the true angles, each turned to the right by yaw_deg.
  std::string known(double yaw_deg) {
    Calibration truth;
    std::string error;
    EXPECT_TRUE(load_calibration(recording() + "/truth.yaml", &truth, &error)) << error;
    const auto rows = read_csv(filmed_recording().read("recording/truth.csv"));
    std::string text = "frame,u_px,v_px,azimuth_deg,elevation_deg,sigma_deg\n";
    for (std::size_t frame = 30; frame < rows.size(); frame += 10) {
      FrameOrientation is;
      is.mode = OrientationMode::kPt;
      is.calibration = truth;
      is.angle = {std::stod(rows[frame].at("pan_rad")), std::stod(rows[frame].at("tilt_rad"))};
      // Row 0 is exposed when the angles hold.
      for (const double u : {40.5, 440.5}) {
        Vector3<double> d;
        EXPECT_EQ(is.direction({u, 0}, &d), ProjectionStatus::kOk);
        const double azimuth = std::atan2(d.y(), d.x()) * 180 / kPi;
        const double elevation = std::asin(-d.z()) * 180 / kPi;
        text += std::to_string(frame) + "," + std::to_string(u) + ",0," +
                std::to_string(azimuth + yaw_deg) + "," + std::to_string(elevation) + ",0.0005\n";
      }
    }
    return directory_.write("known.csv", text);
  }

  std::string copy_of_recording() {
    fs::copy(recording(), directory_.path() + "/copy", fs::copy_options::recursive);
    return directory_.path() + "/copy";
  }

  TemporaryDirectory directory_;
};

TEST_F(VerifyTest, TheTrueCalibrationHolds) {
  const Result result = verify(recording(), recording() + "/truth.yaml", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["verdict"], "holds");
  EXPECT_GE(json["pairs"], 100);
  EXPECT_TRUE(json["causes"].empty());
  EXPECT_THAT(json["sentence"], HasSubstr("sigmas hold: directions of the same place differ by"));
  EXPECT_THAT(directory_.read("out/verification.html"),
              AllOf(HasSubstr("The sigmas hold"), HasSubstr("<svg"), HasSubstr("Corner")));
}

TEST_F(VerifyTest, AWrongFocalLengthIsContradictedAndNamed) {
  const Result result = verify(recording(), changed("value: 8002", "value: 8042"));
  ASSERT_EQ(result.exit_code, 1) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("contradicted: "));
  // By 40 px, 4.5 of the sigmas that are told.
  EXPECT_THAT(result.output,
              ContainsRegex("likeliest cause: focal length \\(off by -(3[2-9]|4[0-8])"));
  EXPECT_TRUE(fs::exists(directory_.path() + "/out/verification.html"));
}

TEST_F(VerifyTest, AWrongClockOffsetOfThisRecordingIsContradictedAndNamed) {
  const std::string copy = copy_of_recording();
  fs::create_directory(copy + "/alidade");
  fs::copy_file(changed("value: -0.0844", "value: -0.0744"), copy + "/alidade/calibration.yaml");
  const Result result = verify(copy, copy + "/alidade/calibration.yaml");
  ASSERT_EQ(result.exit_code, 1) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("likeliest cause: clock offset (off by -"));
}

// It is the link's, and another recording's calibration was made over another one.
TEST_F(VerifyTest, TheClockOffsetOfAnotherRecordingIsFoundAnew) {
  const Result result =
      verify(recording(), changed("value: -0.0844", "value: -0.0744"), {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_NEAR(json["link"]["delay_s"].get<double>(), -0.01,
              5 * json["link"]["sigma_s"].get<double>());
  EXPECT_LT(json["link"]["sigma_s"], 5e-3);
}

TEST_F(VerifyTest, KnownDirectionsThatAgreeHold) {
  const Result result =
      verify(recording(), recording() + "/truth.yaml", {"--known", known(0), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  ASSERT_EQ(json["known"].size(), 2U);
  EXPECT_EQ(json["known"][0]["mode"], "OE");
  for (const auto& each : json["known"]) {
    EXPECT_EQ(each["verdict"], "holds") << each;
    EXPECT_GE(each["directions"], 10) << each;
    EXPECT_EQ(each["offsets"].size(), each["directions"]);
    // OE mode's sigma is 0.2 px here, PT mode's 1.4.
    EXPECT_LT(each["rms_px"].get<double>(), 3 * each["claimed_px"].get<double>()) << each;
    EXPECT_LT(each["claimed_px"], each["mode"] == "OE" ? 0.5 : 2) << each;
  }
  EXPECT_THAT(json["sentence"], HasSubstr("known directions, "));
  EXPECT_THAT(directory_.read("out/verification.html"), HasSubstr("Known directions"));
}

TEST_F(VerifyTest, APlatformThatWasSurveyedTurnedIsContradictedAndTheTurnSaid) {
  const Result result = verify(recording(), recording() + "/truth.yaml", {"--known", known(0.2)});
  ASSERT_EQ(result.exit_code, 1) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("contradicted: known directions, "));
  EXPECT_THAT(
      result.output,
      ContainsRegex("they agree with the platform's heading 0\\.(19[6-9]|20[0-4]).* deg: is the "
                    "platform where the survey has it"));
}

TEST_F(VerifyTest, AHeadingThatIsNotKnownIsEstimated) {
  const Result result = verify(recording(), recording() + "/truth.yaml",
                               {"--known", known(123), "--heading-sigma", "free", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  for (const auto& each : nlohmann::json::parse(result.output)["known"]) {
    EXPECT_EQ(each["verdict"], "holds") << each;
    const auto sigma = each["turn_sigma_deg"][2].get<double>();
    EXPECT_NEAR(each["turn_deg"][2].get<double>(), 123, 5 * sigma);
    EXPECT_LT(sigma, 0.01);
    EXPECT_EQ(each["turn_sigma_deg"][0], 0);
  }
}

TEST_F(VerifyTest, ATurnWithoutKnownDirectionsIsRefused) {
  const Result result =
      verify(recording(), recording() + "/truth.yaml", {"--heading-sigma", "free"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--known"));
  EXPECT_EQ(verify(recording(), recording() + "/truth.yaml",
                   {"--known", known(0), "--level-sigma", "loose"})
                .exit_code,
            2);
}

TEST_F(VerifyTest, KnownDirectionsOfNoFrameAreRefused) {
  const std::string file = directory_.write("known.csv",
                                            "frame,u_px,v_px,azimuth_deg,elevation_deg,sigma_deg\n"
                                            "999,10,20,0,0,0.01\n");
  const Result result = verify(recording(), recording() + "/truth.yaml", {"--known", file});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(
      last_line(result.errors),
      HasSubstr("known.csv:2: frame 999 is not in the recording, whose frames are 0 to 99"));
}

TEST_F(VerifyTest, WhatCannotBeJudgedEndsWithTwo) {
  // Too short: no two pictures lie a second apart, once the clocks have settled.
  const std::string copy = copy_of_recording();
  const std::string frames = filmed_recording().read("recording/frames.csv");
  std::size_t end = 0;
  for (int line = 0; line < 20; ++line) end = frames.find('\n', end) + 1;
  directory_.write("copy/frames.csv", frames.substr(0, end));
  Result result = verify(copy, copy + "/truth.yaml");
  EXPECT_EQ(result.exit_code, 2) << result.output << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("not judged: 0 pairs"), HasSubstr("advice: ")));

  result = verify(recording(), "");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(last_line(result.errors), HasSubstr("has no calibration"));

  directory_.write("copy/lens.zoom-7.yaml", "");
  result = verify(recording(), copy + "/lens.yaml");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(last_line(result.errors),
              AllOf(HasSubstr("lens.yaml: there is no such file"),
                    HasSubstr("of the recording's zoom: " + copy + "/lens.zoom-7.yaml")));

  result = verify(recording(), changed("width: 480", "width: 640"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(last_line(result.errors), HasSubstr("frames have 480x270 px"));

  fs::remove(copy + "/video.mkv");
  result = verify(copy, copy + "/truth.yaml");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(last_line(result.errors), HasSubstr("has no pictures (video.mkv or frames/)"));
}

}  // namespace
}  // namespace alidade

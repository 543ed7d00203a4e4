// `alidade verify` on pictures that the virtual camera rendered: with the true calibration, with
// wrong ones, and where nothing can be judged.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/commands/filmed_recording.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
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
  EXPECT_THAT(result.output, HasSubstr("likeliest cause: focal length (off by -"));
  EXPECT_TRUE(fs::exists(directory_.path() + "/out/verification.html"));
}

TEST_F(VerifyTest, AWrongClockOffsetIsContradictedAndNamed) {
  const Result result = verify(recording(), changed("value: -0.0844", "value: -0.0744"));
  ASSERT_EQ(result.exit_code, 1) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("likeliest cause: clock offset (off by -"));
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

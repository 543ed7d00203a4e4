// `alidade replay` on images that the virtual camera rendered, with its truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/commands/filmed_recording.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;
using Rows = std::vector<std::map<std::string, std::string>>;

constexpr int kFrames = kFilmedFrames;
constexpr double kLongFocalLength = kFilmedFocalLength;

int count_mode(const Rows& rows, const std::string& mode) {
  int count = 0;
  for (const auto& row : rows) count += row.at("mode") == mode ? 1 : 0;
  return count;
}

class ReplayVideoTest : public ::testing::Test {
 protected:
  static std::string recording() { return filmed_recording().path() + "/recording"; }
  // One's own, to spoil.
  std::string copy_of_recording() {
    fs::copy(recording(), directory_.path() + "/copy", fs::copy_options::recursive);
    return directory_.path() + "/copy";
  }

  // Replays with the true calibration.
  Result replay(const std::string& recording, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"replay",
                                          recording,
                                          "--calibration",
                                          recording + "/truth.yaml",
                                          "-o",
                                          directory_.path() + "/out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return alidade(arguments);
  }
  Rows records() { return read_csv(directory_.read("out/orientation.csv")); }

  // Root mean square of the angles' distance from truth, without what all have in common, from 1 s on. px
  static double spread(const Rows& rows, const std::string& angle) {
    const Rows truth = read_csv(filmed_recording().read("recording/truth.csv"));
    std::vector<double> errors;
    for (std::size_t i = 13; i < rows.size(); ++i) {
      EXPECT_EQ(rows[i].at("frame"), truth.at(i).at("frame"));
      errors.push_back(kLongFocalLength *
                       (std::stod(rows[i].at(angle)) - std::stod(truth.at(i).at(angle))));
    }
    double mean = 0;
    for (const double e : errors) mean += e / static_cast<double>(errors.size());
    double square = 0;
    for (const double e : errors) square += (e - mean) * (e - mean);
    return std::sqrt(square / static_cast<double>(errors.size()));
  }

  TemporaryDirectory directory_;
};

TEST_F(ReplayVideoTest, HoldsToLandmarksAndComesMuchNearerToTruthThanTelemetry) {
  Result result = replay(recording(), {"--mode", "PT"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("100 frames: OE 0, PT 100, none 0; step "));
  const Rows pt = records();
  ASSERT_EQ(pt.size(), static_cast<std::size_t>(kFrames));
  for (const auto& row : pt) {
    EXPECT_EQ(row.at("mode"), "PT");
    EXPECT_EQ(row.at("landmarks"), "0");
    EXPECT_EQ(row.at("pan_acceleration_rad_s2"), "0.0");
  }

  result = replay(recording());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Rows oe = records();
  ASSERT_EQ(oe.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(oe.front().at("mode"), "PT");
  EXPECT_EQ(oe.front().at("status"), "too few landmarks");
  EXPECT_GE(count_mode(oe, "OE"), 95);
  for (const auto& row : oe) {
    if (row.at("mode") == "OE") {
      EXPECT_GE(std::stoi(row.at("landmarks")), 20);
      EXPECT_NE(row.at("pan_acceleration_rad_s2"), "0.0");
    } else {
      EXPECT_EQ(row.at("landmarks"), "0");
    }
  }
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("100 frames: OE " + std::to_string(count_mode(oe, "OE"))),
                    HasSubstr(" landmarks (median); step ")));
  for (const char* angle : {"pan_rad", "tilt_rad"}) {
    EXPECT_LT(spread(oe, angle), spread(pt, angle) / 5) << angle;
  }
}

TEST_F(ReplayVideoTest, GivesTheSameBytesAgain) {
  ASSERT_EQ(replay(recording()).exit_code, 0);
  const std::string once = directory_.read("out/orientation.csv");
  const Result again = replay(recording(), {"--mode", "OE", "--csv"});
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(directory_.read("out/orientation.csv"), once);
  EXPECT_EQ(again.output, once);
}

TEST_F(ReplayVideoTest, AnswersFramesWithoutAImageFromTelemetry) {
  const std::string copy = copy_of_recording();
  // As after a kill of the recorder.
  fs::resize_file(copy + "/video.mkv", fs::file_size(copy + "/video.mkv") / 2);
  const Result result = replay(copy);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Rows rows = records();
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(rows[30].at("mode"), "OE");
  for (std::size_t i = 70; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].at("mode"), "PT") << i;
    EXPECT_EQ(rows[i].at("status"), "no usable picture") << i;
  }
}

TEST_F(ReplayVideoTest, UsesTelemetryAloneWhereTheVideoIsNone) {
  const std::string copy = copy_of_recording();
  fs::remove(copy + "/video.mkv");
  directory_.write("copy/video.mkv", "not a video");
  Result result = replay(copy);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, AllOf(HasSubstr("video.mkv"), HasSubstr("replayed in PT mode")));
  EXPECT_EQ(count_mode(records(), "PT"), kFrames);

  fs::remove_all(directory_.path() + "/out");
  result = replay(copy, {"--mode", "OE"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("video.mkv"), Not(HasSubstr("PT mode"))));
  EXPECT_FALSE(fs::exists(directory_.path() + "/out/orientation.csv"));
}

}  // namespace
}  // namespace alidade

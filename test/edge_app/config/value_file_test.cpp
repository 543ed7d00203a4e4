#include "edge_app/config/value_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ValueFile, IsOptional) {
  const TemporaryDirectory directory;
  CalibrationValues values;
  CalibrationLimits limits;
  std::string error;
  EXPECT_TRUE(load_values(directory.path() + "/truth.yaml", &values, &error));
  EXPECT_TRUE(load_limits(directory.path() + "/limit.yaml", &limits, &error));
  EXPECT_FALSE(values.focal_length);
  EXPECT_FALSE(limits.focal_length_rel);
}

TEST(ValueFile, GivesWhatStandsInItAndNothingElse) {
  const TemporaryDirectory directory;
  CalibrationValues values;
  std::string error;
  ASSERT_TRUE(load_values(directory.write("peer.yaml",
                                          "focal_length: {value: 9e4, sigma: 19}\n"
                                          "pan_axis: {value: [0, -0.6, 0.8]}\n"
                                          "pan_scale: {value: 1.01}\n"
                                          "cpu_s: 0.65\nmean_pixel_error_px: 0.39\n"),
                          &values, &error))
      << error;
  EXPECT_EQ(values.focal_length->value, 9e4);
  EXPECT_EQ(values.focal_length->sigma, 19);
  EXPECT_EQ(values.pan_scale->value, 1.01);
  EXPECT_FALSE(values.pan_scale->sigma);
  EXPECT_EQ(*values.pan_axis, Vector3<double>(0, -0.6, 0.8));
  EXPECT_FALSE(values.tilt_axis);
  EXPECT_FALSE(values.clock_offset);
}

TEST(ValueFile, TakesAWholeCalibrationsHead) {
  const TemporaryDirectory directory;
  CalibrationValues values;
  std::string error;
  EXPECT_TRUE(load_values(directory.write("truth.yaml",
                                          "format: 1\nimage: {width: 1920, height: 1080}\n"
                                          "tilt_axis: {value: [0, 1, 0], sigma: [0, 0]}\n"),
                          &values, &error))
      << error;
}

TEST(ValueFile, NamesItsMistakesWithTheirLine) {
  const TemporaryDirectory directory;
  for (const auto& [text, what] :
       {std::pair("focal_lenght: {value: 9e4}\n", "focal_lenght: unknown key"),
        {"focal_length: {value: nan}\n", "focal_length.value: 'nan' is not a plain number"},
        {"focal_length: 9e4\n", "focal_length: expected a mapping"},
        {"focal_length: {sigma: 3}\n", "focal_length.value: is missing"},
        {"focal_length: {value: 9e4, sigma: -3}\n", "focal_length.sigma: '-3' is not"},
        {"pan_axis: {value: [0, 0]}\n", "pan_axis.value: expected a list of 3 plain numbers"},
        {"pan_axis: {value: [0, 0.1, 0]}\n", "pan_axis.value: is not a unit vector"},
        {"clock_offset: {value: 84}\n", "clock_offset.value: '84' is not"}}) {
    CalibrationValues values;
    std::string error;
    const std::string path = directory.write("guess.yaml", std::string("# first line\n") + text);
    EXPECT_FALSE(load_values(path, &values, &error)) << text;
    EXPECT_THAT(error, AllOf(StartsWith(path + ":2: "), HasSubstr(what)));
  }
  CalibrationLimits limits;
  std::string error;
  const std::string path = directory.write("limit.yaml", "line_delay_s: 0\n");
  EXPECT_FALSE(load_limits(path, &limits, &error));
  EXPECT_THAT(error, StartsWith(path + ":1: line_delay_s: '0' is not"));
}

}  // namespace
}  // namespace alidade

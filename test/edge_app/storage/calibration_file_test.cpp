#include "edge_app/storage/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <iterator>
#include <limits>
#include <string>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Calibration some_calibration() {
  Calibration calibration;
  calibration.camera = {32008 + 1 / 3.0, 1, {55.4}, 1920, 1080};
  calibration.line_delay = -14.2e-6;
  calibration.mechanics.pan_axis = Vector3<double>(-0.012, 0.001, 1).normalized();
  calibration.mechanics.tilt_axis = Vector3<double>(0.002, 1, 0.014).normalized();
  calibration.mechanics.pan_scale = 1.0 / 0.97;
  calibration.clock_offset = -84.4e-3;
  for (int i = 0; i < kParameterCount; ++i) calibration.covariance(i, i) = 1e-6;
  return calibration;
}

TEST(CalibrationFile, SavesAndLoads) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/calibration.yaml";
  std::string error;
  ASSERT_TRUE(save_calibration(path, some_calibration(), &error)) << error;
  Calibration calibration;
  ASSERT_TRUE(load_calibration(path, &calibration, &error)) << error;
  EXPECT_EQ(format_calibration(calibration), format_calibration(some_calibration()));
}

TEST(CalibrationFile, SaveReplacesTheOldFileAndLeavesNothingElse) {
  const TemporaryDirectory folder;
  const std::string path = folder.write("calibration.yaml", "old");
  std::string error;
  ASSERT_TRUE(save_calibration(path, some_calibration(), &error)) << error;
  EXPECT_EQ(folder.read("calibration.yaml"), format_calibration(some_calibration()));
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0644u) << "others may read it";
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(CalibrationFile, SaveRefusesWhatLoadWouldRefuseAndKeepsTheOldFile) {
  const TemporaryDirectory folder;
  const std::string path = folder.write("calibration.yaml", "old");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int refused = 0;
  const auto expect_refused = [&](const Calibration& calibration, const char* complaint) {
    std::string error;
    EXPECT_FALSE(save_calibration(path, calibration, &error));
    EXPECT_THAT(error, HasSubstr(complaint));
    EXPECT_THAT(error, StartsWith("refused to write " + path));
    EXPECT_EQ(folder.read("calibration.yaml"), "old");
    ++refused;
  };
  Calibration bad = some_calibration();
  bad.camera.focal_length = nan;
  expect_refused(bad, "focal_length is \"nan\"");
  bad = some_calibration();
  bad.covariance(3, 5) = nan;
  expect_refused(bad, "covariance.matrix");
  bad = some_calibration();
  bad.covariance(0, 0) = -1;
  expect_refused(bad, "focal_length.sigma");
  bad = some_calibration();
  bad.mechanics.pan_axis *= 2;
  expect_refused(bad, "a unit vector is needed");
  bad = some_calibration();
  bad.camera.width = 0;
  expect_refused(bad, "image.width");
  EXPECT_EQ(refused, 5);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(CalibrationFile, SaysWhyAFileCannotBeReadOrWritten) {
  const TemporaryDirectory folder;
  Calibration calibration;
  std::string error;
  EXPECT_FALSE(load_calibration(folder.path() + "/none.yaml", &calibration, &error));
  EXPECT_EQ(error, folder.path() + "/none.yaml: cannot be read: No such file or directory");
  EXPECT_FALSE(load_calibration(folder.path(), &calibration, &error));
  EXPECT_THAT(error, HasSubstr("cannot be read: not a file, but a folder"));
  EXPECT_FALSE(load_calibration(folder.write("empty.yaml", ""), &calibration, &error));
  EXPECT_THAT(error, HasSubstr("empty.yaml:1: not a calibration"));
  EXPECT_FALSE(save_calibration(folder.path() + "/no/x.yaml", some_calibration(), &error));
  EXPECT_THAT(error, HasSubstr("cannot be written: No such file or directory"));
  EXPECT_FALSE(save_calibration(folder.path(), some_calibration(), &error));
  EXPECT_THAT(error, HasSubstr("cannot be written: "));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + ".yaml"));
}

}  // namespace
}  // namespace alidade

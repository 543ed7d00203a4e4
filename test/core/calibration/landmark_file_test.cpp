#include "core/calibration/landmark_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <random>

#include "core/calibration/calibration_file.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::size_t kHeaderSize = 24;
constexpr std::size_t kLandmarkSize = 60;
constexpr std::size_t kChecksumSize = 4;

Calibration some_calibration() {
  Calibration calibration;
  calibration.camera = {4000 + 1 / 3.0, 1, -0.3, 1920, 1080};
  calibration.line_delay = 1e-6 / 3;
  calibration.mechanics.pan_axis = Vector3<double>(0.02, -0.01, 1).normalized();
  calibration.clock_offset = -0.1 / 3;
  return calibration;
}

std::vector<CalibrationLandmark> some_landmarks(int count) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<CalibrationLandmark> landmarks;
  for (int i = 0; i < count; ++i) {
    CalibrationLandmark landmark;
    landmark.landmark = i == 0 ? std::numeric_limits<std::int64_t>::min() : 1000000007LL * i;
    landmark.d_b = Vector3<double>(normal(random), normal(random), normal(random)).normalized();
    Matrix2<double> factor;
    factor << normal(random), 0, normal(random), normal(random);
    landmark.covariance = 1e-10 * factor * factor.transpose();
    landmark.observations = 2 + i;
    landmarks.push_back(landmark);
  }
  return landmarks;
}

bool parse(const std::string& bytes, std::vector<CalibrationLandmark>* landmarks,
           std::string* error) {
  return parse_landmarks(bytes, "map.bin", some_calibration(), landmarks, error);
}

TEST(LandmarkFile, ReadsBackTheSameBits) {
  const std::vector<CalibrationLandmark> written = some_landmarks(7);
  const std::string bytes = format_landmarks(written, some_calibration());
  EXPECT_EQ(bytes.size(), kHeaderSize + 7 * kLandmarkSize + kChecksumSize);
  std::vector<CalibrationLandmark> read;
  std::string error;
  ASSERT_TRUE(parse(bytes, &read, &error)) << error;
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].landmark, written[i].landmark);
    EXPECT_EQ(read[i].d_b, written[i].d_b);
    EXPECT_EQ(read[i].covariance, written[i].covariance);
    EXPECT_EQ(read[i].observations, written[i].observations);
  }
}

TEST(LandmarkFile, HoldsNoLandmarkToo) {
  std::vector<CalibrationLandmark> read = some_landmarks(1);
  std::string error;
  ASSERT_TRUE(parse(format_landmarks({}, some_calibration()), &read, &error)) << error;
  EXPECT_TRUE(read.empty());
}

TEST(LandmarkFile, IsLittleEndianWithItsVersionFirst) {
  const std::string bytes = format_landmarks(some_landmarks(3), some_calibration());
  EXPECT_EQ(bytes.substr(0, 12), std::string("ALIDMAP\n\1\0\0\0", 12));
  EXPECT_EQ(bytes.substr(16, 8), std::string("\3\0\0\0\0\0\0\0", 8));
}

TEST(LandmarkFile, RefusesEachDamagedByteAndKeepsWhatTheCallerHad) {
  const std::string whole = format_landmarks(some_landmarks(2), some_calibration());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int damage : {0x01, 0x80, 0xff}) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(bytes[i] ^ damage);
      std::vector<CalibrationLandmark> read(1);
      std::string error;
      EXPECT_FALSE(parse(bytes, &read, &error)) << "byte " << i;
      EXPECT_EQ(read.size(), 1U);
      EXPECT_THAT(error, StartsWith("map.bin: "));
      EXPECT_EQ(error.find('\n'), std::string::npos);
    }
  }
}

TEST(LandmarkFile, RefusesEveryOtherLength) {
  const std::string whole = format_landmarks(some_landmarks(2), some_calibration());
  std::vector<CalibrationLandmark> read;
  std::string error;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse(whole.substr(0, size), &read, &error)) << size;
  }
  EXPECT_FALSE(parse(whole + '\0', &read, &error));
  EXPECT_FALSE(parse(whole + whole, &read, &error));
}

TEST(LandmarkFile, SaysWhichVersionItCannotRead) {
  std::string bytes = format_landmarks(some_landmarks(1), some_calibration());
  bytes[8] = 2;
  std::vector<CalibrationLandmark> read;
  std::string error;
  EXPECT_FALSE(parse(bytes, &read, &error));
  EXPECT_THAT(error, HasSubstr("version 2, this program reads version 1"));
}

TEST(LandmarkFile, RefusesTheMapOfAnotherCalibration) {
  const std::string bytes = format_landmarks(some_landmarks(1), some_calibration());
  Calibration other = some_calibration();
  other.line_delay = std::nextafter(other.line_delay, 1);
  std::vector<CalibrationLandmark> read;
  std::string error;
  EXPECT_FALSE(parse_landmarks(bytes, "map.bin", other, &read, &error));
  EXPECT_THAT(error, HasSubstr("another calibration"));
}

TEST(LandmarkFile, FitsItsCalibrationAfterThatOneWasStoredAndRead) {
  const TemporaryDirectory directory;
  const Calibration calibration = some_calibration();
  std::string error;
  ASSERT_TRUE(save_calibration(directory.path() + "/calibration.yaml", calibration, &error))
      << error;
  ASSERT_TRUE(save_landmarks(directory.path() + "/map.bin", some_landmarks(3), calibration, &error))
      << error;
  Calibration read;
  ASSERT_TRUE(load_calibration(directory.path() + "/calibration.yaml", &read, &error)) << error;
  std::vector<CalibrationLandmark> landmarks;
  ASSERT_TRUE(load_landmarks(directory.path() + "/map.bin", read, &landmarks, &error)) << error;
  EXPECT_EQ(landmarks.size(), 3U);
}

TEST(LandmarkFile, RefusesLandmarksThatMakeNoSense) {
  const auto refused = [](void (*spoil)(CalibrationLandmark*), const char* why) {
    std::vector<CalibrationLandmark> landmarks = some_landmarks(2);
    spoil(&landmarks[1]);
    std::vector<CalibrationLandmark> read;
    std::string error;
    // The checksum fits: only the number is wrong.
    EXPECT_FALSE(parse(format_landmarks(landmarks, some_calibration()), &read, &error)) << why;
    EXPECT_THAT(error, HasSubstr(why));
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refused([](CalibrationLandmark* l) { l->d_b[1] = kNan; }, "not finite");
  refused([](CalibrationLandmark* l) { l->covariance(1, 1) = HUGE_VAL; }, "not finite");
  refused([](CalibrationLandmark* l) { l->d_b *= 1 + 1e-6; }, "no unit vector");
  refused([](CalibrationLandmark* l) { l->covariance(0, 0) *= -1; }, "not positive");
  refused([](CalibrationLandmark* l) { l->covariance(0, 1) = l->covariance(1, 0) = 1; },
          "not positive");
  refused([](CalibrationLandmark* l) { l->observations = -1; }, "negative number");
}

TEST(LandmarkFile, SavingReplacesTheOldFileWholeAndLeavesNothingElse) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("map.bin", "old");
  std::string error;
  ASSERT_TRUE(save_landmarks(path, some_landmarks(2), some_calibration(), &error)) << error;
  EXPECT_EQ(directory.read("map.bin"), format_landmarks(some_landmarks(2), some_calibration()));
  std::vector<CalibrationLandmark> spoilt = some_landmarks(2);
  spoilt[0].d_b.setZero();
  EXPECT_FALSE(save_landmarks(path, spoilt, some_calibration(), &error));
  EXPECT_EQ(directory.read("map.bin"), format_landmarks(some_landmarks(2), some_calibration()));
  const auto files = std::filesystem::directory_iterator(directory.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(LandmarkFile, NamesTheFileThatCannotBeReadOrWritten) {
  const TemporaryDirectory directory;
  std::vector<CalibrationLandmark> landmarks;
  std::string error;
  EXPECT_FALSE(load_landmarks(directory.path() + "/none", some_calibration(), &landmarks, &error));
  EXPECT_THAT(error, StartsWith(directory.path() + "/none: cannot be read: No such file"));
  EXPECT_FALSE(load_landmarks(directory.path(), some_calibration(), &landmarks, &error));
  EXPECT_THAT(error, StartsWith(directory.path() + ": "));
  const std::string nowhere = directory.path() + "/none/map.bin";
  EXPECT_FALSE(save_landmarks(nowhere, some_landmarks(1), some_calibration(), &error));
  EXPECT_THAT(error, StartsWith(nowhere + ": cannot be written: No such file"));
}

}  // namespace
}  // namespace alidade

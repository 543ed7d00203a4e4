#include "edge_app/storage/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "core/realtime/oe_mode/landmark_map.h"
#include "edge_app/storage/calibration_file.h"
#include "test/support/not_a_number.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::size_t kHeaderSize = 352;
constexpr std::size_t kPointSize = 60;
constexpr std::size_t kLandmarkSize = 464;
constexpr std::size_t kChecksumSize = 4;
constexpr std::size_t kPoints = 16;     // where their number stands
constexpr std::size_t kLandmarks = 24;  // likewise

Calibration map_calibration() {
  Calibration calibration;
  calibration.camera = {4000 + 1 / 3.0, 1, {-0.3}, 1920, 1080};
  calibration.line_delay = 1e-6 / 3;
  calibration.mechanics.pan_axis = Vector3<double>(0.02, -0.01, 1).normalized();
  calibration.clock_offset = -0.1 / 3;
  return calibration;
}

class Random {
 public:
  double normal() { return normal_(random_); }
  int byte() { return std::uniform_int_distribution<int>(0, 255)(random_); }
  Vector3<double> direction() { return Vector3<double>(normal(), normal(), normal()).normalized(); }
  template <int kSize>
  Matrix<double, kSize, kSize> covariance(double scale) {
    Matrix<double, kSize, kSize> factor;
    for (int i = 0; i < kSize * kSize; ++i) factor(i) = normal();
    const Matrix<double, kSize, kSize> product = scale * factor * factor.transpose();
    return product.template selfadjointView<Eigen::Upper>();
  }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<double> normal_;
};

MapContent some_content(int points, int landmarks) {
  Random random;
  MapContent content;
  for (int i = 0; i < points; ++i) {
    CalibrationLandmark point;
    point.landmark = i == 0 ? std::numeric_limits<std::int64_t>::min() : 1000000007LL * i;
    point.d_b = random.direction();
    point.covariance = random.covariance<2>(1e-10);
    point.observations = 2 + i;
    content.points.push_back(point);
  }
  MapState& map = content.map;
  for (int i = 0; i < landmarks; ++i) {
    Landmark landmark;
    landmark.octave = static_cast<std::uint8_t>(i % LandmarkMap::kMaxOctaves);
    landmark.d = random.direction();
    landmark.covariance = random.covariance<2>(1e-10);
    landmark.shared_covariance = random.covariance<2>(1e-10);
    for (int j = 0; j < landmark.sensitivity.size(); ++j) {
      landmark.sensitivity(j) = static_cast<float>(random.normal());
    }
    landmark.J_pixel_tangent << 4000 + random.normal(), random.normal(), random.normal(), 4000;
    for (std::uint8_t& pixel : landmark.pixels) pixel = static_cast<std::uint8_t>(random.byte());
    landmark.statistics.looked_for = 10 + static_cast<std::uint32_t>(i);
    landmark.statistics.matched = 10;
    landmark.statistics.residual_square = 1.1F;
    map.landmarks.push_back(landmark);
  }
  map.offset = {1e-3 / 3, -1e-4 / 3};
  map.offset_covariance = random.covariance<2>(1e-12);
  for (Matrix3<double>& shear : map.shear_covariance) shear = random.covariance<3>(1e-8);
  map.shear_tilt = -0.1 / 3;
  for (int i = 0; i < map.offset_sensitivity.size(); ++i) {
    map.offset_sensitivity(i) = random.normal();
  }
  return content;
}

bool parse(const std::string& bytes, MapContent* content, std::string* error) {
  return parse_map(bytes, "map.bin", map_calibration(), content, error);
}

std::string some_bytes(int points, int landmarks) {
  return format_map(some_content(points, landmarks), map_calibration());
}

void expect_the_same_bits(const MapContent& written, const Calibration& calibration,
                          std::size_t size) {
  const std::string bytes = format_map(written, calibration);
  EXPECT_EQ(bytes.size(), size);
  MapContent read;
  std::string error;
  ASSERT_TRUE(parse_map(bytes, "map.bin", calibration, &read, &error)) << error;
  ASSERT_EQ(read.points.size(), written.points.size());
  for (std::size_t i = 0; i < read.points.size(); ++i) {
    EXPECT_EQ(read.points[i].landmark, written.points[i].landmark);
    EXPECT_EQ(read.points[i].d_b, written.points[i].d_b);
    EXPECT_EQ(read.points[i].covariance, written.points[i].covariance);
    EXPECT_EQ(read.points[i].observations, written.points[i].observations);
  }
  const MapState& map = read.map;
  EXPECT_EQ(map.offset.vector(), written.map.offset.vector());
  EXPECT_EQ(map.offset_covariance, written.map.offset_covariance);
  EXPECT_EQ(map.shear_covariance[0], written.map.shear_covariance[0]);
  EXPECT_EQ(map.shear_covariance[1], written.map.shear_covariance[1]);
  EXPECT_EQ(map.shear_tilt, written.map.shear_tilt);
  EXPECT_EQ(map.offset_sensitivity, written.map.offset_sensitivity);
  ASSERT_EQ(map.landmarks.size(), written.map.landmarks.size());
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    const Landmark& is = map.landmarks[i];
    const Landmark& was = written.map.landmarks[i];
    EXPECT_EQ(is.octave, was.octave);
    EXPECT_EQ(is.d, was.d);
    EXPECT_EQ(is.covariance, was.covariance);
    EXPECT_EQ(is.shared_covariance, was.shared_covariance);
    EXPECT_EQ(is.sensitivity, was.sensitivity);
    EXPECT_EQ(is.J_pixel_tangent, was.J_pixel_tangent);
    EXPECT_EQ(is.pixels, was.pixels);
    EXPECT_EQ(is.statistics.looked_for, was.statistics.looked_for);
    EXPECT_EQ(is.statistics.matched, was.statistics.matched);
    EXPECT_EQ(is.statistics.residual_square, was.statistics.residual_square);
  }
  EXPECT_EQ(format_map(read, calibration), bytes);
}

TEST(MapFile, ReadsBackTheSameBits) {
  MapContent written = some_content(7, 9);
  // Where the optical centre is the image's middle exactly, what follows it is not kept.
  const int centre = index(Parameter::kCentreU);
  written.map.offset_sensitivity.middleCols<2>(centre).setZero();
  for (Landmark& landmark : written.map.landmarks)
    landmark.sensitivity.middleCols<2>(centre).setZero();
  expect_the_same_bits(written, map_calibration(),
                       kHeaderSize + 7 * kPointSize + 9 * kLandmarkSize + kChecksumSize);
}

TEST(MapFile, ReadsBackWhatFollowsTheOpticalCentre) {
  Calibration calibration = map_calibration();
  calibration.camera.centre_v = -2.5;
  expect_the_same_bits(
      some_content(7, 9), calibration,
      kHeaderSize + 32 + 7 * kPointSize + 9 * (kLandmarkSize + 16) + kChecksumSize);
  MapContent read;
  std::string error;
  EXPECT_FALSE(parse(format_map(some_content(2, 2), calibration), &read, &error));
}

TEST(MapFile, HoldsNothingToo) {
  MapContent read = some_content(1, 1);
  std::string error;
  ASSERT_TRUE(parse(format_map({}, map_calibration()), &read, &error)) << error;
  EXPECT_TRUE(read.points.empty());
  EXPECT_TRUE(read.map.landmarks.empty());
}

TEST(MapFile, IsLittleEndianWithItsVersionFirst) {
  const std::string bytes = some_bytes(3, 2);
  EXPECT_EQ(bytes.substr(0, 12), std::string("ALIDMAP\n\3\0\0\0", 12));
  EXPECT_EQ(bytes.substr(kPoints, 8), std::string("\3\0\0\0\0\0\0\0", 8));
  EXPECT_EQ(bytes.substr(kLandmarks, 8), std::string("\2\0\0\0\0\0\0\0", 8));
}

TEST(MapFile, RefusesEachDamagedByteAndKeepsWhatTheCallerHad) {
  const std::string whole = some_bytes(2, 2);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int damage : {0x01, 0x80, 0xff}) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(bytes[i] ^ damage);
      MapContent read = some_content(1, 0);
      std::string error;
      EXPECT_FALSE(parse(bytes, &read, &error)) << "byte " << i;
      EXPECT_EQ(read.points.size(), 1U);
      EXPECT_THAT(error, StartsWith("map.bin: "));
      EXPECT_EQ(error.find('\n'), std::string::npos);
    }
  }
}

TEST(MapFile, RefusesEveryOtherLength) {
  const std::string whole = some_bytes(2, 2);
  MapContent read;
  std::string error;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse(whole.substr(0, size), &read, &error)) << size;
  }
  EXPECT_FALSE(parse(whole + '\0', &read, &error));
  EXPECT_FALSE(parse(whole + whole, &read, &error));
}

// Would they be believed, memory for them could not be had.
TEST(MapFile, TakesNoMemoryForCountsBeyondTheFile) {
  const std::string whole = some_bytes(2, 2);
  for (const std::size_t at : {kPoints, kLandmarks}) {
    for (const std::uint64_t count :
         {std::uint64_t{3}, std::uint64_t{1} << 40, std::uint64_t{1} << 61, ~std::uint64_t{0},
          // Times their size they are, modulo 2^64, about what the file has.
          ~std::uint64_t{0} / kPointSize + 3, ~std::uint64_t{0} / kLandmarkSize + 3}) {
      std::string bytes = whole;
      for (std::size_t i = 0; i < 8; ++i) {
        bytes[at + i] = static_cast<char>((count >> (8 * i)) & 0xff);
      }
      MapContent read;
      std::string error;
      EXPECT_FALSE(parse(bytes, &read, &error)) << count;
      EXPECT_THAT(error, HasSubstr("its size does not fit"));
    }
  }
}

TEST(MapFile, SaysWhichVersionItCannotRead) {
  std::string bytes = some_bytes(1, 0);
  MapContent read;
  std::string error;
  for (const char version : {'\2', '\4'}) {
    bytes[8] = version;
    // Others are of another length.
    for (const std::size_t size : {bytes.size(), std::size_t{28}}) {
      EXPECT_FALSE(parse(bytes.substr(0, size), &read, &error));
      EXPECT_EQ(error, "map.bin: map of version " + std::to_string(int{version}) +
                           ", this program reads version 3; calibrate again");
    }
  }
}

TEST(MapFile, RefusesTheMapOfAnotherCalibration) {
  Calibration other = map_calibration();
  other.line_delay = std::nextafter(other.line_delay, 1);
  MapContent read;
  std::string error;
  EXPECT_FALSE(parse_map(some_bytes(1, 1), "map.bin", other, &read, &error));
  EXPECT_THAT(error, HasSubstr("another calibration"));
}

TEST(MapFile, FitsItsCalibrationAfterThatOneWasStoredAndRead) {
  const TemporaryDirectory directory;
  const Calibration calibration = map_calibration();
  std::string error;
  ASSERT_TRUE(save_calibration(directory.path() + "/calibration.yaml", calibration, &error))
      << error;
  ASSERT_TRUE(save_map(directory.path() + "/map.bin", some_content(3, 4), calibration, &error))
      << error;
  Calibration read;
  ASSERT_TRUE(load_calibration(directory.path() + "/calibration.yaml", &read, &error)) << error;
  MapContent content;
  ASSERT_TRUE(load_map(directory.path() + "/map.bin", read, &content, &error)) << error;
  EXPECT_EQ(content.points.size(), 3U);
  EXPECT_EQ(content.map.landmarks.size(), 4U);
}

// The checksum fits: only the number is wrong.
void expect_refused(void (*spoil)(MapContent*), const char* why) {
  MapContent content = some_content(2, 2);
  spoil(&content);
  MapContent read;
  std::string error;
  EXPECT_FALSE(parse(format_map(content, map_calibration()), &read, &error)) << why;
  EXPECT_THAT(error, HasSubstr(why));
}

TEST(MapFile, RefusesPointsThatMakeNoSense) {
  expect_refused([](MapContent* c) { c->points[1].d_b[1] = kNan; }, "not finite");
  expect_refused([](MapContent* c) { c->points[1].covariance(1, 1) = HUGE_VAL; }, "not finite");
  expect_refused([](MapContent* c) { c->points[1].d_b *= 1 + 1e-6; }, "not a unit vector");
  expect_refused([](MapContent* c) { c->points[1].covariance(0, 0) *= -1; }, "not positive");
  expect_refused([](MapContent* c) { c->points[1].covariance(0, 1) = 1; }, "not positive");
  expect_refused([](MapContent* c) { c->points[1].observations = -1; }, "negative number");
}

TEST(MapFile, RefusesLandmarksThatMakeNoSense) {
  expect_refused([](MapContent* c) { c->map.landmarks[1].d[2] = kNan; }, "landmark 1 has a number");
  expect_refused([](MapContent* c) { c->map.landmarks[1].d.setZero(); }, "not a unit vector");
  expect_refused([](MapContent* c) { c->map.landmarks[1].octave = 8; }, "octave");
  expect_refused([](MapContent* c) { c->map.landmarks[1].covariance(1, 1) = -1e-20; },
                 "not positive");
  expect_refused([](MapContent* c) { c->map.landmarks[1].covariance(0, 0) = 0; }, "not positive");
  expect_refused([](MapContent* c) { c->map.landmarks[1].shared_covariance(0, 1) = 1; },
                 "not positive");
  expect_refused([](MapContent* c) { c->map.landmarks[1].shared_covariance(0, 1) = kNan; },
                 "not finite");
  expect_refused([](MapContent* c) { c->map.landmarks[1].sensitivity(0, 5) = HUGE_VALF; },
                 "not finite");
  expect_refused([](MapContent* c) { c->map.landmarks[1].J_pixel_tangent.setOnes(); }, "no extent");
  expect_refused([](MapContent* c) { c->map.landmarks[1].J_pixel_tangent(1, 0) = HUGE_VAL; },
                 "not finite");
  expect_refused([](MapContent* c) { c->map.landmarks[1].statistics.matched = 99; }, "more often");
  expect_refused([](MapContent* c) { c->map.landmarks[1].statistics.residual_square = -1; },
                 "negative square");
  expect_refused([](MapContent* c) { c->map.landmarks[1].statistics.residual_square = HUGE_VALF; },
                 "not finite");
}

TEST(MapFile, RefusesAFrameThatMakesNoSense) {
  expect_refused([](MapContent* c) { c->map.offset.tilt = kNan; }, "its frame has a number");
  expect_refused([](MapContent* c) { c->map.offset_covariance(0, 0) = -1; }, "not positive");
  expect_refused([](MapContent* c) { c->map.shear_tilt = HUGE_VAL; }, "not finite");
  expect_refused([](MapContent* c) { c->map.offset_sensitivity(1, 12) = kNan; }, "not finite");
  expect_refused([](MapContent* c) { c->map.shear_covariance[0](0, 2) = kNan; }, "not finite");
  expect_refused([](MapContent* c) { c->map.shear_covariance[1](1, 2) = 1; }, "not positive");
  // Each two of the three may be so, but not all three.
  expect_refused(
      [](MapContent* c) { c->map.shear_covariance[1] << 1, 0.9, 0.9, 0.9, 1, -0.9, 0.9, -0.9, 1; },
      "not positive");
}

TEST(MapFile, RefusesAnOctaveThatNoByteHolds) {
  std::string bytes = some_bytes(0, 1);
  bytes[kHeaderSize + 1] = 1;  // 256 more
  bytes.resize(bytes.size() - kChecksumSize);
  const std::uint32_t check = static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>((check >> (8 * i)) & 0xff));
  MapContent read;
  std::string error;
  EXPECT_FALSE(parse(bytes, &read, &error));
  EXPECT_THAT(error, HasSubstr("octave"));
}

TEST(MapFile, SavingReplacesTheOldFileWholeAndLeavesNothingElse) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("map.bin", "old");
  std::string error;
  ASSERT_TRUE(save_map(path, some_content(2, 2), map_calibration(), &error)) << error;
  EXPECT_EQ(directory.read("map.bin"), some_bytes(2, 2));
  MapContent spoilt = some_content(2, 2);
  spoilt.points[0].d_b.setZero();
  EXPECT_FALSE(save_map(path, spoilt, map_calibration(), &error));
  EXPECT_EQ(directory.read("map.bin"), some_bytes(2, 2));
  const auto files = std::filesystem::directory_iterator(directory.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(MapFile, NamesTheFileThatCannotBeReadOrWritten) {
  const TemporaryDirectory directory;
  MapContent content;
  std::string error;
  EXPECT_FALSE(load_map(directory.path() + "/none", map_calibration(), &content, &error));
  EXPECT_THAT(error, StartsWith(directory.path() + "/none: cannot be read: No such file"));
  EXPECT_FALSE(load_map(directory.path(), map_calibration(), &content, &error));
  EXPECT_THAT(error, StartsWith(directory.path() + ": "));
  const std::string nowhere = directory.path() + "/none/map.bin";
  EXPECT_FALSE(save_map(nowhere, some_content(1, 1), map_calibration(), &error));
  EXPECT_THAT(error, StartsWith(nowhere + ": cannot be written: No such file"));
}

}  // namespace
}  // namespace alidade

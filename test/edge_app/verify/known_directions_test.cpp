// Known directions: what a file may say, and whether the judgement is as sure as the sigmas are.

#include "edge_app/verify/known_directions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/model/mechanics.h"
#include "test/edge_app/verify/seen_places.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using Parameters = Eigen::Matrix<double, kParameterCount, 1>;

constexpr double kDegree = kPi / 180;
constexpr double kAngle_rad = 5e-5;  // of a frame
constexpr double kStated_rad = 2e-5;

struct KnownErrors {
  Parameters parameters = Parameters::Zero();
  Vector3<double> turn = Vector3<double>::Zero();  // of the platform against the base
  double frames = 1;                               // errors of the frames by their sigma
  bool alike = false;                              // all frames have the same error
};

// Directions that were surveyed exactly but for their stated sigma. Every third is a horizon.
std::vector<KnownSight> survey(std::uint64_t seed, const KnownErrors& errors, int count = 12) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const Calibration calibration = test::verified_calibration();
  Parameters off = errors.parameters;
  for (int i = 0; i < kParameterCount; ++i)
    off[i] += std::sqrt(calibration.covariance(i, i)) * normal(generator);
  const Calibration truth = test::moved(calibration, off);
  std::uniform_real_distribution<double> u(20, 620);
  std::uniform_real_distribution<double> v(20, 340);
  std::vector<KnownSight> out;
  Vector2<double> shared(normal(generator), normal(generator));
  for (int i = 0; i < count; ++i) {
    FrameOrientation is;
    is.mode = OrientationMode::kPt;
    is.calibration = truth;
    is.angle = {0.3 * std::sin(1.1 * i), 0.1 * std::sin(1.7 * i)};
    KnownSight sight;
    KnownDirection& known = sight.known;
    known.frame = i;
    known.pixel = {u(generator), v(generator)};
    known.sigma = kStated_rad;
    Vector3<double> d;
    EXPECT_EQ(is.direction(known.pixel, &d), ProjectionStatus::kOk);
    d = exp_so3(errors.turn) * d;
    known.elevation = std::asin(-d.z()) + kStated_rad * normal(generator);
    if (i % 3 != 2)
      known.azimuth =
          std::atan2(d.y(), d.x()) + kStated_rad * normal(generator) / std::hypot(d.x(), d.y());
    FrameOrientation& seen = sight.by_telemetry;
    seen = is;
    seen.calibration = calibration;
    seen.motion_covariance.diagonal().head<2>().setConstant(kAngle_rad * kAngle_rad);
    seen.motion_sensitivity = telemetry_sensitivity(calibration.mechanics, is.motion());
    const Eigen::Matrix<double, 6, 1> by_parameters = seen.motion_sensitivity * off;
    if (!errors.alike) shared = {normal(generator), normal(generator)};
    seen.angle.pan -= by_parameters[0] + errors.frames * kAngle_rad * shared.x();
    seen.angle.tilt -= by_parameters[1] + errors.frames * kAngle_rad * shared.y();
    sight.by_landmarks = seen;
    sight.by_landmarks.mode = OrientationMode::kOe;
    out.push_back(sight);
  }
  return out;
}

KnownResult check(const std::vector<KnownSight>& sights) {
  return check_known(sights, OrientationFrom::kTelemetry, test::verified_calibration().covariance);
}

// One in a thousand may be found by chance in 400 trials: three are found with a chance of 1 %.
TEST(KnownDirections, TrueSigmasAreNotContradictedWhetherErrorsAreAlikeOrNot) {
  for (const bool alike : {false, true}) {
    int found = 0;
    double squares = 0;
    constexpr int kTrials = 400;
    for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
      KnownErrors errors;
      errors.alike = alike;
      const KnownResult result = check(survey(seed, errors));
      EXPECT_EQ(result.numbers, 20);
      EXPECT_GT(result.share, 0.5);
      found += result.log_chance < std::log(1e-3) ? 1 : 0;
      squares += result.ratio * result.ratio / kTrials;
    }
    EXPECT_LE(found, 3) << alike;
    // The mean over trials of a chi-square by its freedom, about 3 here: 0.04 is its deviation.
    EXPECT_NEAR(squares, 1, 0.2) << alike;
  }
}

TEST(KnownDirections, AWrongCalibrationIsContradictedAndNoTurnExplainsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    KnownErrors errors;
    errors.parameters[index(Parameter::kFocalLength)] = 60;
    const KnownResult result = check(survey(seed, errors));
    EXPECT_LT(result.log_chance, std::log(1e-4)) << seed;
    ASSERT_TRUE(result.has_turn);
    EXPECT_LT(result.log_chance_turned, std::log(1e-4)) << seed;
  }
}

TEST(KnownDirections, APlatformThatIsTurnedIsContradictedAndTheTurnExplainsIt) {
  const Vector3<double> turn(2e-3, -4e-3, 9e-3);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    KnownErrors errors;
    errors.turn = turn;
    const KnownResult result = check(survey(seed, errors));
    EXPECT_LT(result.log_chance, std::log(1e-4)) << seed;
    ASSERT_TRUE(result.has_turn);
    EXPECT_GT(result.log_chance_turned, std::log(1e-4)) << seed;
    for (int i = 0; i < 3; ++i)
      EXPECT_LT(std::abs(result.turn[i] - turn[i]), 5 * result.turn_sigma[i]) << seed << " " << i;
  }
}

TEST(KnownDirections, AHorizonAloneIsOneNumberAndNoTurn) {
  std::vector<KnownSight> sights = survey(1, {}, 4);
  for (KnownSight& sight : sights) sight.known.azimuth.reset();
  const KnownResult result = check(sights);
  EXPECT_EQ(result.numbers, 4);
  EXPECT_FALSE(result.has_turn);
  EXPECT_EQ(result.offsets.size(), 4U);
  sights[0].by_telemetry.mode = OrientationMode::kNone;
  EXPECT_EQ(check(sights).numbers, 3);
  EXPECT_EQ(check({}).numbers, 0);
}

TEST(KnownDirections, AreReadFromATable) {
  TemporaryDirectory directory;
  const auto read = [&](const std::string& text, std::string* error) {
    std::vector<KnownDirection> out;
    const std::string path = directory.write("known.csv", text);
    return read_known_directions(path, 640, 360, &out, error) ? out : std::vector<KnownDirection>{};
  };
  const std::string columns = "frame,u_px,v_px,azimuth_deg,elevation_deg,sigma_deg\n";
  std::string error;
  const auto known = read(columns + "7,10.5,20,-90,4,0.01\n9,11,21,,0.5,0.02\n", &error);
  ASSERT_EQ(known.size(), 2U) << error;
  EXPECT_EQ(known[0].frame, 7);
  EXPECT_DOUBLE_EQ(*known[0].azimuth, -90 * kDegree);
  EXPECT_DOUBLE_EQ(known[0].elevation, 4 * kDegree);
  EXPECT_FALSE(known[1].azimuth);
  EXPECT_DOUBLE_EQ(known[1].sigma, 0.02 * kDegree);

  const auto refused = [&](const std::string& text, const std::string& why) {
    EXPECT_TRUE(read(text, &error).empty()) << text;
    EXPECT_THAT(error, HasSubstr(why));
    EXPECT_EQ(error.find('\n'), std::string::npos);
  };
  refused(columns, "known.csv: has no row; give frame,u_px,v_px");
  refused(columns + "7,640.5,20,0,4,0.01\n", "is outside the pictures of 640x360 px");
  refused(columns + "7,10,20,0,91,0.01\n", "elevation_deg 91 must be from -90 to 90");
  refused(columns + "7,10,20,0,9,0\n", "sigma_deg 0 must be above 0");
  refused(columns + "7.5,10,20,0,9,0.1\n", "frame");
  refused("frame,u_px,v_px,azimuth_deg,sigma_deg\n7,10,20,0,0.1\n", "elevation_deg");
}

}  // namespace
}  // namespace alidade

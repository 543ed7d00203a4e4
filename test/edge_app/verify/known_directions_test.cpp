// Known directions: what a table may say, and whether the judgement is as sure as the sigmas are.

#include "edge_app/verify/known_directions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/model/angle.h"
#include "core/model/mechanics.h"
#include "core/model/rotation.h"
#include "test/edge_app/verify/seen_places.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using Parameters = Eigen::Matrix<double, kParameterCount, 1>;

constexpr double kDegree = kPi / 180;
constexpr double kAngle_rad = 5e-5;  // of a frame
constexpr double kStated_rad = 2e-5;
constexpr TurnSigma kAnyHeading = {TurnSigma::kFree, 0};
constexpr TurnSigma kAnyTurn = {TurnSigma::kFree, TurnSigma::kFree};

struct KnownErrors {
  Parameters parameters = Parameters::Zero();
  Vector3<double> turn = Vector3<double>::Zero();  // the platform's roll, pitch and heading
  bool alike = false;                              // all frames have the same error
  bool two_zooms = false;                          // each with errors of its own
};

// Directions that were surveyed exactly but for their stated sigma. Every third is a horizon.
std::vector<KnownSight> survey(std::uint64_t seed, const KnownErrors& errors, int count = 12) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const Matrix3<double> turn = rotation_about<double>(Vector3<double>::UnitZ(), errors.turn.z()) *
                               rotation_about<double>(Vector3<double>::UnitY(), errors.turn.y()) *
                               rotation_about<double>(Vector3<double>::UnitX(), errors.turn.x());
  std::uniform_real_distribution<double> u(20, 620);
  std::uniform_real_distribution<double> v(20, 340);
  std::vector<Calibration> calibrations;
  std::vector<Parameters> offs;
  for (const double f : {4000, 5000}) {
    calibrations.push_back(test::verified_calibration());
    calibrations.back().camera.focal_length = f;
    offs.push_back(errors.parameters);
    for (int i = 0; i < kParameterCount; ++i)
      offs.back()[i] += std::sqrt(calibrations.back().covariance(i, i)) * normal(generator);
  }
  std::vector<KnownSight> out;
  Vector2<double> shared(normal(generator), normal(generator));
  for (int i = 0; i < count; ++i) {
    const std::size_t zoom = errors.two_zooms && i % 2 == 1 ? 1 : 0;
    FrameOrientation is;
    is.mode = OrientationMode::kPt;
    is.calibration = test::moved(calibrations[zoom], offs[zoom]);
    is.angle = {0.3 * std::sin(1.1 * i), 0.1 * std::sin(1.7 * i)};
    KnownSight sight;
    KnownDirection& known = sight.known;
    known.frame = i;
    known.pixel = {u(generator), v(generator)};
    known.sigma = kStated_rad;
    Vector3<double> d;
    EXPECT_EQ(is.direction(known.pixel, &d), ProjectionStatus::kOk);
    d = (turn * d).eval();
    known.elevation = std::asin(-d.z()) + kStated_rad * normal(generator);
    if (i % 3 != 2) {
      known.azimuth =
          std::atan2(d.y(), d.x()) + kStated_rad * normal(generator) / std::hypot(d.x(), d.y());
    }
    FrameOrientation& seen = sight.by_telemetry;
    seen = is;
    seen.calibration = calibrations[zoom];
    seen.motion_covariance.diagonal().head<2>().setConstant(kAngle_rad * kAngle_rad);
    seen.motion_sensitivity = telemetry_sensitivity(calibrations[zoom].mechanics, is.motion());
    const Eigen::Matrix<double, 6, 1> by_parameters = seen.motion_sensitivity * offs[zoom];
    if (!errors.alike) shared = {normal(generator), normal(generator)};
    seen.angle.pan -= by_parameters[0] + kAngle_rad * shared.x();
    seen.angle.tilt -= by_parameters[1] + kAngle_rad * shared.y();
    sight.by_landmarks = seen;
    sight.by_landmarks.mode = OrientationMode::kOe;
    out.push_back(sight);
  }
  return out;
}

KnownResult check(const std::vector<KnownSight>& sights, const TurnSigma& turn = {}) {
  return check_known(sights, OrientationFrom::kTelemetry, turn);
}

struct Case {
  bool alike = false;
  bool two_zooms = false;
  TurnSigma turn;
  bool is_exact = false;  // the mean of ratio^2 is 1; else at most 1
};

// One in a thousand may be found by chance in 400 trials: more than three with a chance of 1 in
// 1000.
TEST(KnownDirections, TrueSigmasAreNotContradictedWhetherErrorsAreAlikeOrNot) {
  constexpr TurnSigma kStated = {0.01, 0.01};
  for (const Case& is :
       {Case{false, false, {}, true}, Case{true, false, {}, true}, Case{false, true, {}, true},
        Case{false, false, kAnyHeading, false}, Case{true, false, kAnyHeading, false},
        Case{false, true, kAnyTurn, false}, Case{true, false, kAnyTurn, false},
        Case{false, false, kStated, false}, Case{true, true, kStated, false}}) {
    int found = 0;
    double squares = 0;
    Vector3<double> turn_squares = Vector3<double>::Zero();
    constexpr int kTrials = 400;
    for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
      KnownErrors errors;
      errors.alike = is.alike;
      errors.two_zooms = is.two_zooms;
      std::mt19937_64 generator(seed + 7777);
      std::normal_distribution<double> normal;
      for (int axis = 0; axis < 3; ++axis) {
        const double sigma = axis == 2 ? is.turn.heading : is.turn.level;
        if (sigma > 0) errors.turn[axis] = 0.01 * normal(generator);
      }
      const KnownResult result = check(survey(seed, errors), is.turn);
      ASSERT_TRUE(result.is_determined);
      EXPECT_EQ(result.numbers, 20);
      EXPECT_GT(result.share, 0.2);
      found += result.log_chance < std::log(1e-3) ? 1 : 0;
      squares += result.ratio * result.ratio / kTrials;
      for (int axis = 0; axis < 3; ++axis) {
        if (!(result.turn_sigma[axis] > 0)) continue;
        const double off = (result.turn - errors.turn)[axis] / result.turn_sigma[axis];
        turn_squares[axis] += off * off / kTrials;
      }
    }
    const auto which = [&is] {
      return ::testing::Message() << is.alike << is.two_zooms << is.turn.heading << is.turn.level;
    };
    EXPECT_LE(found, 3) << which();
    // The mean over trials of a chi-square by its freedom, at least 2: its deviation is 0.05.
    EXPECT_LT(squares, 1.2) << which();
    if (is.is_exact) EXPECT_GT(squares, 0.8) << which();
    EXPECT_LT(turn_squares.maxCoeff(), 1.3) << which();
  }
}

TEST(KnownDirections, AWrongCalibrationIsContradictedAndNoTurnExplainsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    KnownErrors errors;
    errors.parameters[index(Parameter::kFocalLength)] = 60;
    for (const TurnSigma& turn : {TurnSigma{}, kAnyHeading, kAnyTurn}) {
      const KnownResult result = check(survey(seed, errors), turn);
      ASSERT_TRUE(result.is_determined);
      EXPECT_LT(result.log_chance, std::log(1e-4)) << seed << " " << turn.level;
    }
  }
}

TEST(KnownDirections, ATurnedPlatformIsContradictedUnlessItsTurnIsEstimated) {
  const Vector3<double> turn(2e-3, -4e-3, 9e-3);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    KnownErrors errors;
    errors.turn = turn;
    const std::vector<KnownSight> sights = survey(seed, errors);
    EXPECT_LT(check(sights).log_chance, std::log(1e-4)) << seed;
    // Its level is wrong, too.
    EXPECT_LT(check(sights, kAnyHeading).log_chance, std::log(1e-4)) << seed;
    // A sigma of a thousandth of the turn.
    EXPECT_LT(check(sights, {1e-5, 1e-5}).log_chance, std::log(1e-4)) << seed;
    const KnownResult result = check(sights, kAnyTurn);
    ASSERT_TRUE(result.is_determined);
    EXPECT_GT(result.log_chance, std::log(1e-4)) << seed;
    for (int i = 0; i < 3; ++i) {
      EXPECT_GT(result.turn_sigma[i], 0);
      EXPECT_LT(result.turn_sigma[i], 1e-3);
      EXPECT_LT(std::abs(result.turn[i] - turn[i]), 5 * result.turn_sigma[i]) << seed << " " << i;
    }
  }
}

// A table from the north, of a platform that heads anywhere.
TEST(KnownDirections, AnyHeadingIsEstimated) {
  for (const double heading : {-3.1, -1.5, 0.7, 3.0}) {
    KnownErrors errors;
    errors.turn = {-0.02, 0.01, heading};
    for (const bool is_level : {true, false}) {
      if (is_level) errors.turn.head<2>().setZero();
      const std::vector<KnownSight> sights = survey(3, errors);
      const KnownResult result = check(sights, is_level ? kAnyHeading : kAnyTurn);
      ASSERT_TRUE(result.is_determined);
      EXPECT_GT(result.log_chance, std::log(1e-4)) << heading;
      for (int i = is_level ? 2 : 0; i < 3; ++i) {
        EXPECT_LT(std::abs(result.turn[i] - errors.turn[i]), 5 * result.turn_sigma[i]) << heading;
        EXPECT_LT(result.turn_sigma[i], 1e-3);
      }
      EXPECT_LT(result.rms, 1e-3);
      const KnownResult stated = check(sights);
      EXPECT_LT(stated.log_chance, std::log(1e-4));
      EXPECT_GT(stated.rms_px, 1000);
      errors.turn = {-0.02, 0.01, heading};
    }
  }
}

TEST(KnownDirections, OffsetsAreInPixelsOfThePicture) {
  std::vector<KnownSight> sights = survey(1, {}, 3);
  for (KnownSight& sight : sights) sight.known.elevation += 0.01;
  const KnownResult result = check(sights);
  for (const KnownOffset& each : result.offsets) {
    EXPECT_NEAR(each.off.y(), 0.01, 1e-3);
    // Up in the picture by f times the angle.
    EXPECT_NEAR(each.off_px.y(), -40, 4);
    EXPECT_NEAR(each.off_px.x(), 0, 4);
    // Of one angle or both.
    const double sigma = each.sigma.norm();
    EXPECT_NEAR(each.claimed_px, 4000 * sigma, 0.1 * 4000 * sigma);
    EXPECT_GT(each.sigmas, 50);
  }
  EXPECT_NEAR(result.rms_px, 40, 4);
}

TEST(KnownDirections, AHorizonAloneIsOneNumberAndHasNoHeading) {
  std::vector<KnownSight> sights = survey(1, {}, 4);
  for (KnownSight& sight : sights) sight.known.azimuth.reset();
  KnownResult result = check(sights, kAnyHeading);
  ASSERT_TRUE(result.is_determined);
  EXPECT_EQ(result.numbers, 4);
  EXPECT_EQ(result.offsets.size(), 4U);
  EXPECT_EQ(result.turn_sigma.z(), 0);
  result = check(sights, kAnyTurn);
  ASSERT_TRUE(result.is_determined);
  EXPECT_GT(result.turn_sigma.x(), 0);
  EXPECT_GT(result.turn_sigma.y(), 0);
  EXPECT_EQ(result.turn_sigma.z(), 0);
  sights[0].by_telemetry.mode = OrientationMode::kNone;
  EXPECT_EQ(check(sights).numbers, 3);
  EXPECT_TRUE(check({}).offsets.empty());
}

TEST(KnownDirections, OneDirectionDoesNotTellATurn) {
  const std::vector<KnownSight> sights = survey(1, {}, 1);
  EXPECT_TRUE(check(sights).is_determined);
  EXPECT_TRUE(check(sights, kAnyHeading).is_determined);
  const KnownResult result = check(sights, kAnyTurn);
  EXPECT_FALSE(result.is_determined);
  EXPECT_EQ(result.offsets.size(), 1U);
}

TEST(KnownDirections, AreReadFromATable) {
  TemporaryDirectory directory;
  const KnownLimits limits = {640, 360, {7, 9}};
  const auto read = [&](const std::string& text, std::string* error) {
    std::vector<KnownDirection> out;
    const std::string path = directory.write("known.csv", text);
    return read_known_directions(path, limits, &out, error) ? out : std::vector<KnownDirection>{};
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
    EXPECT_THAT(error, HasSubstr("known.csv:"));
    EXPECT_THAT(error, HasSubstr(why));
    EXPECT_EQ(error.find('\n'), std::string::npos);
  };
  refused(columns, "known.csv: has no row; give frame,u_px,v_px");
  refused(columns + "\n8,1,1,0,0,1\n",
          ":3: frame 8 is not in the recording, whose frames are 7 to 9");
  refused(columns + "7,640.5,20,0,4,0.01\n",
          ":2: pixel (640.5, 20) is outside the pictures of 640x360 px");
  refused(columns + "7,10,20,361,9,0.01\n", "azimuth_deg 361 must be from -360 to 360");
  refused(columns + "7,10,20,0,91,0.01\n", "elevation_deg 91 must be from -90 to 90");
  refused(columns + "7,10,20,0,9,0\n", "sigma_deg 0 must be above 0, up to 10");
  refused(columns + "7.5,10,20,0,9,0.1\n", "'7.5' in column frame is not a whole number");
  refused(columns + "7,10,20,0,,0.1\n", "'' in column elevation_deg is not a number");
  refused("frame,u_px,v_px,azimuth_deg,sigma_deg\n7,10,20,0,0.1\n", "no column 'elevation_deg'");
  std::string many = columns;
  for (int i = 0; i <= kMostKnownDirections; ++i) many += "7,10,20,0,9,0.1\n";
  refused(many, ":1002: more than 1000 directions; give those that lie farthest apart");
}

}  // namespace
}  // namespace alidade

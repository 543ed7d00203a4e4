// Whether departures are found where there are some, by their name and size, and only there.

#include "edge_app/verify/model_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/calibration/centre_frame.h"
#include "edge_app/verify/verification_words.h"
#include "test/edge_app/verify/seen_places.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::Contains;

constexpr double kLimit = 4e-4;

ModelCheckResult check(std::uint64_t seed, const test::PlaceErrors& errors) {
  const test::SeenPlaces seen = test::see_places(seed, errors);
  return check_model(seen.frames, seen.pairs, seen.calibration, {}, 1, std::log(kLimit));
}

// Of the departure that is found, and of no other one before it.
DepartureTest only_cause(const test::PlaceErrors& errors, Departure departure) {
  const ModelCheckResult result = check(7, errors);
  if (result.found.empty() || result.found.front().departure != departure) {
    ADD_FAILURE() << "not found: " << static_cast<int>(departure);
    return {};
  }
  return result.found.front();
}

test::PlaceErrors off(Parameter parameter, double by) {
  test::PlaceErrors errors;
  errors.parameters[index(parameter)] = by;
  return errors;
}

TEST(ModelCheck, FindsNothingMoreOftenThanChanceHasItInAModelThatHolds) {
  constexpr int kRuns = 40;
  constexpr double kLevel = 0.05;
  int tests = 0;
  int alarms = 0;
  int found = 0;
  for (int run = 0; run < kRuns; ++run) {
    const ModelCheckResult result = check(static_cast<std::uint64_t>(run + 1), {});
    for (const DepartureTest& test : result.tests) {
      if (test.freedom == 0) continue;
      ++tests;
      if (test.log_chance < std::log(kLevel)) ++alarms;
    }
    found += static_cast<int>(result.found.size());
  }
  EXPECT_EQ(tests, kRuns * kDepartureCount);
  // Tests of one run share its data, up to all of them: binomial for the runs, 4 sigmas.
  EXPECT_LE(alarms, kLevel * tests + 4 * kDepartureCount * std::sqrt(kRuns * kLevel / 4));
  EXPECT_GE(alarms, 1);
  // 1 % of the runs by Bonferroni; three of 40 have a chance of 0.7 %.
  EXPECT_LT(found, 3);
}

// Errors in variables: what multiplies an uncertain rate, as the line delay does.
TEST(ModelCheck, IsNotBiasedByUncertainRates) {
  constexpr int kRuns = 40;
  test::PlaceErrors errors;
  errors.is_wide = true;
  errors.rate_sigma_rad_s = 0.03;
  const std::array<Departure, 2> judged = {Departure::kLineDelay, Departure::kClockOffset};
  std::array<double, 2> sum{};
  std::array<double, 2> square{};
  for (int run = 0; run < kRuns; ++run) {
    const ModelCheckResult result = check(static_cast<std::uint64_t>(run + 1), errors);
    for (std::size_t k = 0; k < judged.size(); ++k) {
      const DepartureTest* test = test_of(result.tests, judged[k]);
      ASSERT_NE(test, nullptr);
      sum[k] += test->size.front() / test->sigma.front();
      square[k] += test->chi_square;
    }
  }
  for (std::size_t k = 0; k < judged.size(); ++k) {
    SCOPED_TRACE(k);
    // Four sigmas each.
    EXPECT_LT(std::abs(sum[k] / kRuns), 4 / std::sqrt(kRuns));
    EXPECT_NEAR(square[k] / kRuns, 1, 4 * std::sqrt(2.0 / kRuns));
  }
}

TEST(ModelCheck, FindsNoDepartureThatIsNotJudged) {
  const test::SeenPlaces seen = test::see_places(7, off(Parameter::kLineDelay, 3e-6));
  const ModelCheckResult result = check_model(seen.frames, seen.pairs, seen.calibration, {}, 1,
                                              std::log(kLimit), {Departure::kLineDelay});
  EXPECT_EQ(test_of(result.tests, Departure::kLineDelay)->freedom, 0);
  EXPECT_EQ(test_of(result.found, Departure::kLineDelay), nullptr);
}

// As compressed pictures have them: neither a departure nor noise of telemetry.
TEST(ModelCheck, TakesErrorsThatThePlacesOfAPairShareForThePictures) {
  constexpr int kRuns = 20;
  test::PlaceErrors errors;
  errors.shared_px = 0.1;
  int found = 0;
  for (int run = 0; run < kRuns; ++run)
    found += static_cast<int>(check(static_cast<std::uint64_t>(run + 1), errors).found.size());
  // 1 % of the runs; two of 20 have a chance of 1.7 %.
  EXPECT_LT(found, 2);
}

TEST(ModelCheck, NamesAWrongFocalLength) {
  const DepartureTest test = only_cause(off(Parameter::kFocalLength, 8), Departure::kFocalLength);
  ASSERT_EQ(test.size.size(), 1U);
  EXPECT_NEAR(test.size[0], 8, 4 * std::hypot(test.sigma[0], 0.4));
}

TEST(ModelCheck, NamesAWrongClockOffset) {
  const DepartureTest test =
      only_cause(off(Parameter::kClockOffset, 3e-3), Departure::kClockOffset);
  ASSERT_EQ(test.size.size(), 1U);
  EXPECT_NEAR(test.size[0], 3e-3, 4 * std::hypot(test.sigma[0], 1e-4));
}

TEST(ModelCheck, NamesAWrongLens) {
  static_cast<void>(only_cause(off(Parameter::kRadialDistortion, 3), Departure::kDistortion));
  static_cast<void>(only_cause(off(Parameter::kCentreU, 20), Departure::kCentre));
  static_cast<void>(only_cause(off(Parameter::kLineDelay, 3e-6), Departure::kLineDelay));
}

// A frame that turns with the centre's estimate has the centre's error at the picture's edge alone.
TEST(ModelCheck, AllowsForTheErrorOfACentreThatIsExactByDefinition) {
  test::PlaceErrors errors;
  errors.is_wide = true;
  const Vector2<double> off(0.5, -0.5);  // px
  errors.parameters = axes_by_centre(test::wide_calibration()) * off;
  errors.parameters.segment<2>(index(Parameter::kCentreU)) = off;
  const DepartureTest test = only_cause(errors, Departure::kCentre);
  EXPECT_LT(test.log_chance, std::log(kLimit));
  errors.centre_error_px = 0.5;
  EXPECT_TRUE(check(7, errors).found.empty());
}

TEST(ModelCheck, NamesAGear) {
  test::PlaceErrors errors;
  errors.pan_gear_rad = 3e-4;
  const DepartureTest test = only_cause(errors, Departure::kPanGear);
  ASSERT_EQ(test.at.size(), test.size.size());
  // Knots give a sine of four knots a period to a fifth; what all have in common means nothing.
  double mean = 0;
  for (const double size : test.size) mean += size / static_cast<double>(test.size.size());
  double largest = 0;
  for (const double size : test.size) largest = std::max(largest, std::abs(size - mean));
  EXPECT_GT(largest, 2e-4);
  EXPECT_LT(largest, 5e-4);
}

TEST(ModelCheck, NamesPlay) {
  test::PlaceErrors errors;
  errors.tilt_play_rad = 3e-4;
  const DepartureTest test = only_cause(errors, Departure::kTiltPlay);
  ASSERT_EQ(test.size.size(), 1U);
  EXPECT_NEAR(test.size[0], 3e-4, 4 * test.sigma[0]);
}

// With what is stated, either would be a gear or an axis: its errors are as large as theirs.
TEST(ModelCheck, NamesJitterOfTelemetrysTimes) {
  test::PlaceErrors errors;
  errors.time_jitter_s = 5e-3;
  const DepartureTest test = only_cause(errors, Departure::kTimeJitter);
  ASSERT_EQ(test.size.size(), 1U);
  // Of an RMS over 48 frames.
  EXPECT_NEAR(test.sigma[0], 5e-3 / std::sqrt(2 * 48.0), 2.5e-4);
  EXPECT_NEAR(test.size[0], 5e-3, 4 * 5e-3 / std::sqrt(2 * 48.0));
  EXPECT_EQ(check(7, errors).found.size(), 1U);
}

TEST(ModelCheck, NamesNoiseOfTelemetrysAngles) {
  test::PlaceErrors errors;
  errors.angle_noise_rad = 3e-4;
  const DepartureTest test = only_cause(errors, Departure::kAngleNoise);
  ASSERT_EQ(test.size.size(), 1U);
  EXPECT_NEAR(test.size[0], 3e-4, 4 * 3e-4 / std::sqrt(4 * 48.0));
  EXPECT_EQ(check(7, errors).found.size(), 1U);
}

TEST(ModelCheck, FindsAGearBesideJitter) {
  test::PlaceErrors errors;
  errors.time_jitter_s = 2e-3;
  errors.pan_gear_rad = 3e-4;
  std::vector<Departure> found;
  for (const DepartureTest& test : check(7, errors).found) found.push_back(test.departure);
  // Four knots a period leave some of the gear, which looks like noise.
  EXPECT_THAT(found, AllOf(Contains(Departure::kPanGear), Contains(Departure::kTimeJitter)));
}

TEST(ModelCheck, SaysNothingWithoutPairs) {
  const ModelCheckResult result = check_model({}, {}, test::verified_calibration(), {}, 1, -8);
  EXPECT_TRUE(result.tests.empty());
  EXPECT_TRUE(result.found.empty());
}

}  // namespace
}  // namespace alidade

// Whether claims are judged as their distribution says: pairs with the claimed errors, and with
// larger ones.

#include "edge_app/verify/claim_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/calibration/chance.h"
#include "test/edge_app/verify/seen_places.h"

namespace alidade {
namespace {

ClaimResult claims_of(std::uint64_t seed, double growth, bool two_zooms = false) {
  test::PlaceErrors errors;
  errors.growth = growth;
  errors.two_zooms = two_zooms;
  const test::SeenPlaces seen = test::see_places(seed, errors);
  return check_claims(
      pair_means(pair_rows(seen.frames, seen.pairs, OrientationFrom::kTelemetry), 1), seen.frames,
      OrientationFrom::kTelemetry, 1);
}

TEST(ClaimCheck, KnowsTheQuantilesOfChiSquare) {
  for (const double freedom : {5.0, 12.0, 80.0, 400.0}) {
    // P(normal > 1.96) = 0.025; Wilson and Hilferty's approximation is good to a few per cent.
    EXPECT_NEAR(std::exp(internal::log_chance(chi_square_at(1.959964, freedom), freedom)), 0.025,
                0.001)
        << freedom;
  }
}

TEST(ClaimCheck, FindsTrueClaimsTooSmallAsOftenAsChanceHasIt) {
  constexpr int kRuns = 200;
  constexpr double kLevel = 0.05;
  int alarms = 0;
  double square = 0;
  double inverse_freedom = 0;
  for (int run = 0; run < kRuns; ++run) {
    const ClaimResult result = claims_of(static_cast<std::uint64_t>(run + 1), 1);
    if (result.log_chance < std::log(kLevel)) ++alarms;
    square += result.ratio * result.ratio / kRuns;
    inverse_freedom += 1 / result.freedom / kRuns;
  }
  // Binomial, 4 sigmas. The matched chi-square is an approximation, best in the bulk.
  EXPECT_LE(alarms, kRuns * kLevel + 4 * std::sqrt(kRuns * kLevel * (1 - kLevel)));
  EXPECT_GE(alarms, 1);
  // The mean square of the ratio is 1; its variance 2 / freedom a run.
  EXPECT_NEAR(square, 1, 4 * std::sqrt(2 * inverse_freedom / kRuns));
}

// The calibration of the one zoom has larger errors than that of the other. Whether errors of two
// zooms are alike is not known, so the ratio may be less than 1, and alarms fewer.
TEST(ClaimCheck, TakesEachZoomsOwnSigmas) {
  constexpr int kRuns = 60;
  constexpr double kLevel = 0.05;
  int alarms = 0;
  double square = 0;
  for (int run = 0; run < kRuns; ++run) {
    const ClaimResult result = claims_of(static_cast<std::uint64_t>(run + 1), 1, true);
    if (result.log_chance < std::log(kLevel)) ++alarms;
    square += result.ratio * result.ratio / kRuns;
  }
  EXPECT_LE(alarms, kRuns * kLevel + 4 * std::sqrt(kRuns * kLevel * (1 - kLevel)));
  EXPECT_GT(square, 0.5);
  EXPECT_LT(square, 1.1);
}

TEST(ClaimCheck, CountsPairsThatShareFramesOnce) {
  const ClaimResult result = claims_of(1, 1);
  EXPECT_GT(result.pairs, 60);
  // Each frame's two angles are all that is new in it.
  EXPECT_LT(result.freedom, 2.0 * result.frames);
  EXPECT_GT(result.freedom, 0.2 * result.frames);
  EXPECT_LT(result.low, result.ratio);
  EXPECT_GT(result.high, result.ratio);
}

TEST(ClaimCheck, FindsErrorsOfTwiceWhatIsClaimed) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    EXPECT_LT(claims_of(seed, 2).log_chance, std::log(4e-4)) << seed;
}

}  // namespace
}  // namespace alidade

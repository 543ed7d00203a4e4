#include "core/calibration/zoom_stretches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace alidade {
namespace {

// Readings at 10 Hz.
std::vector<ZoomReading> readings(const std::vector<double>& zooms) {
  std::vector<ZoomReading> all;
  for (std::size_t i = 0; i < zooms.size(); ++i)
    all.push_back({0.1 * static_cast<double>(i), zooms[i]});
  return all;
}

TEST(ZoomStretches, AreWhereTheReadingStandsStill) {
  const auto found = find_zoom_stretches(readings({5, 5, 5, 6, 7, 8, 9, 9, 9, 9}), {0, 0.2, 0.15});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].zoom, 5);
  EXPECT_NEAR(found[0].end_s, 0.2, 1e-12);
  EXPECT_EQ(found[1].zoom, 9);
  EXPECT_NEAR(found[1].begin_s, 0.6, 1e-12);
  EXPECT_NEAR(found[1].end_s, 0.9, 1e-12);
}

TEST(ZoomStretches, AGlitchEndsNone) {
  const auto found =
      find_zoom_stretches(readings({5, 5, 5, 0, 5, 5, 5, 5, 900, 5, 5}), {0, 0.25, 0});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].end_s, 1, 1e-12);
}

TEST(ZoomStretches, AMovementThereAndBackEndsOne) {
  const auto found =
      find_zoom_stretches(readings({5, 5, 5, 5, 5, 6, 7, 8, 7, 6, 5, 5, 5, 5, 5}), {0, 0.25, 0.35});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].end_s, 0.4, 1e-12);
  EXPECT_NEAR(found[1].begin_s, 1, 1e-12);
}

TEST(ZoomStretches, TakesAFlickerWithinItsToleranceForOne) {
  const std::vector<ZoomReading> flicker = readings({5, 6, 5, 4, 5, 6, 6, 5});
  ASSERT_EQ(find_zoom_stretches(flicker, {1, 0.2, 0.5}).size(), 1u);
  EXPECT_EQ(find_zoom_stretches(flicker, {1, 0.2, 0.5})[0].zoom, 5);
  EXPECT_TRUE(find_zoom_stretches(flicker, {0, 0, 0.5}).empty());
}

TEST(ZoomStretches, LeavesOutWhatIsNoReading) {
  const double nan = std::nan("");
  const double infinite = std::numeric_limits<double>::infinity();
  const auto found = find_zoom_stretches(readings({nan, 5, nan, 5, infinite, 5}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].begin_s, 0.1, 1e-12);
  EXPECT_NEAR(found[0].end_s, 0.5, 1e-12);
  EXPECT_TRUE(find_zoom_stretches({}).empty());
  EXPECT_TRUE(find_zoom_stretches(readings({nan})).empty());
}

}  // namespace
}  // namespace alidade

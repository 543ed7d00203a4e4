// The landmark map against plain models: a search of everything, a std::map of cells.

#include "core/realtime/oe_mode/landmark_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "core/model/angle.h"
#include "core/model/direction.h"

namespace alidade::test {
namespace {

constexpr double kSizes[] = {1e-5, 0.002, 0.06, 0.5};

Vector3<double> anywhere(std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  Vector3<double> d(normal(*random), normal(*random), normal(*random));
  return d.normalized();
}

Vector3<double> near(const Vector3<double>& d, double angle, std::mt19937_64* random) {
  std::uniform_real_distribution<double> turn(-kPi, kPi);
  const double t = turn(*random);
  return direction_plus(d, Vector2<double>(angle * std::cos(t), angle * std::sin(t))).normalized();
}

Vector3<double> from_angles(double azimuth, double from_pole) {
  return {std::sin(from_pole) * std::cos(azimuth), std::sin(from_pole) * std::sin(azimuth),
          std::cos(from_pole)};
}

// Axes, where rings and columns begin and end.
std::vector<Vector3<double>> hard_directions() {
  std::vector<Vector3<double>> directions;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) directions.push_back(sign * Vector3<double>::Unit(axis));
  }
  for (const double from_pole : {0.0, 1e-9, 1e-5, 1.0, kPi / 2, kPi - 1e-5, kPi}) {
    for (const double azimuth : {-kPi, -kPi + 1e-9, -kPi / 2, 0.0, kPi - 1e-9, kPi}) {
      directions.push_back(from_angles(azimuth, from_pole));
    }
  }
  return directions;
}

Landmark landmark_at(const Vector3<double>& d, int octave = 0) {
  Landmark landmark;
  landmark.d = d;
  landmark.octave = static_cast<std::uint8_t>(octave);
  return landmark;
}

std::vector<int> plain_find(const LandmarkMap& map, const Vector3<double>& centre, double cosine) {
  std::vector<int> slots;
  for (int slot = 0; slot < map.capacity(); ++slot) {
    if (map.occupied(slot) && map.at(slot).d.dot(centre) >= cosine) slots.push_back(slot);
  }
  return slots;
}

std::vector<int> find(const LandmarkMap& map, const Vector3<double>& centre, double cosine) {
  std::vector<int> slots(static_cast<std::size_t>(map.capacity()), -1);
  const int count = map.find(centre, cosine, slots.data(), map.capacity());
  slots.resize(static_cast<std::size_t>(count));
  return slots;
}

// Fills what it can of a map with directions near others.
void fill(LandmarkMap* map, int count, double spread, std::mt19937_64* random) {
  Vector3<double> d = anywhere(random);
  int slot = 0;
  for (int i = 0; i < count; ++i) {
    d = i % 50 == 0 ? anywhere(random) : near(d, spread, random);
    (void)map->insert(landmark_at(d, i % 3), 0, &slot);
  }
}

TEST(LandmarkMap, BeginsEmptyAndClearsToEmpty) {
  LandmarkMap map(10, 0.1);
  const auto expect_empty = [&] {
    EXPECT_EQ(map.size(), 0);
    EXPECT_EQ(map.replaced(), 0);
    EXPECT_THAT(find(map, Vector3<double>::UnitX(), -1), testing::IsEmpty());
    for (int slot = -1; slot <= 10; ++slot) EXPECT_FALSE(map.occupied(slot));
    EXPECT_FALSE(map.cell_taken(Vector3<double>::UnitX(), 0));
  };
  EXPECT_EQ(map.capacity(), 10);
  expect_empty();
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  const std::uint32_t id = map.at(slot).id;
  map.clear(0.2);
  EXPECT_EQ(map.cell_size(), 0.2);
  expect_empty();
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  EXPECT_NE(map.at(slot).id, id);
}

// Cells that another focal length made stand in nobody's way, and those of a longer one are as much smaller.
TEST(LandmarkMap, CellsFollowTheZoom) {
  constexpr double kCell = 0.01;
  std::mt19937_64 random(11);
  LandmarkMap map(1000, kCell);
  const Vector3<double> d = anywhere(&random);
  int slot = 0;
  for (const int zoom : {-LandmarkMap::kMaxZoom, -1, 0, 1, 9, LandmarkMap::kMaxZoom}) {
    EXPECT_FALSE(map.cell_taken(d, 1, zoom));
    ASSERT_EQ(map.insert(landmark_at(d, 1), 0, &slot, zoom), InsertStatus::kOk);
    EXPECT_TRUE(map.cell_taken(d, 1, zoom));
    EXPECT_EQ(map.insert(landmark_at(d, 1), 0, &slot, zoom), InsertStatus::kCellTaken);
  }
  // How many of very many neighbours find a cell of their own: as many as there are cells, a quarter of them at half the focal
  // length, but for those that the border cuts.
  const auto cells = [&](int zoom) {
    LandmarkMap many(8000, kCell);
    std::uniform_real_distribution<double> within(-0.2, 0.2);
    for (int i = 0; i < 40000; ++i) {
      const Vector3<double> by(within(random), within(random), 1);
      static_cast<void>(many.insert(landmark_at(by.normalized()), 0, &slot, zoom));
    }
    return many.size();
  };
  const double ratio = static_cast<double>(cells(0)) / cells(-LandmarkMap::kZoomsPerOctave);
  EXPECT_GT(ratio, 3.2);
  EXPECT_LT(ratio, 4.2);
}

TEST(LandmarkMap, TakesTheNearestUsefulCapacityAndCellSize) {
  EXPECT_EQ(LandmarkMap(0, 0.1).capacity(), 1);
  EXPECT_EQ(LandmarkMap(-5, 0.1).capacity(), 1);
  EXPECT_EQ(LandmarkMap(1, 7).cell_size(), 0.5);
  EXPECT_EQ(LandmarkMap(1, 0).cell_size(), 1e-6);
  EXPECT_EQ(LandmarkMap(1, -1).cell_size(), 1e-6);
  EXPECT_EQ(LandmarkMap(1, NAN).cell_size(), 1e-6);
}

TEST(LandmarkMap, FourThousandLandmarksNeedLessThanFourMebibytes) {
  const LandmarkMap map(4096, 1e-3);
  EXPECT_LE(map.memory_bytes(), std::size_t{4} << 20);
  EXPECT_GE(map.memory_bytes(), 4096 * sizeof(Landmark));
}

TEST(LandmarkMap, KeepsWhatItIsGivenWithANewIdAndFreshStatistics) {
  LandmarkMap map(4, 0.1);
  Landmark landmark = landmark_at(Vector3<double>(0.6, 0, 0.8), 3);
  landmark.id = 77;
  landmark.covariance << 2, 1, 1, 3;
  landmark.shared_covariance << 5, 0, 0, 6;
  landmark.J_pixel_tangent << 7, 8, 9, 10;
  landmark.pixels[100] = 11;
  landmark.statistics.looked_for = 12;
  int slot = -1;
  ASSERT_EQ(map.insert(landmark, 1000, &slot), InsertStatus::kOk);
  ASSERT_TRUE(map.occupied(slot));
  const Landmark& kept = map.at(slot);
  EXPECT_EQ(kept.octave, 3);
  EXPECT_LE((kept.d - landmark.d).norm(), 1e-15);
  EXPECT_EQ(kept.covariance, landmark.covariance);
  EXPECT_EQ(kept.shared_covariance, landmark.shared_covariance);
  EXPECT_EQ(kept.J_pixel_tangent, landmark.J_pixel_tangent);
  EXPECT_EQ(kept.pixels, landmark.pixels);
  EXPECT_NE(kept.id, 77U);
  EXPECT_EQ(kept.statistics.looked_for, 0U);
  EXPECT_EQ(kept.statistics.last_frame, 1000U);
}

TEST(LandmarkMap, RefusesWhatHasNoCell) {
  LandmarkMap map(4, 0.1);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  int slot = -7;
  for (const Vector3<double>& d :
       {Vector3<double>(0, 0, 0), Vector3<double>(NAN, 0, 1), Vector3<double>(kInfinity, 0, 0),
        Vector3<double>(1, 0, -kInfinity), Vector3<double>(1.001, 0, 0)}) {
    EXPECT_EQ(map.insert(landmark_at(d), 0, &slot), InsertStatus::kBad);
    EXPECT_FALSE(map.cell_taken(d, 0));
    EXPECT_THAT(find(map, d, -1), testing::IsEmpty());
  }
  const Vector3<double> d = Vector3<double>::UnitX();
  EXPECT_EQ(map.insert(landmark_at(d, LandmarkMap::kMaxOctaves), 0, &slot), InsertStatus::kBad);
  EXPECT_EQ(map.insert(landmark_at(d, 255), 0, &slot), InsertStatus::kBad);
  EXPECT_FALSE(map.cell_taken(d, -1));
  EXPECT_FALSE(map.cell_taken(d, LandmarkMap::kMaxOctaves));
  EXPECT_EQ(slot, -7);
  EXPECT_EQ(map.size(), 0);
}

TEST(LandmarkMap, ACellOfAnOctaveHoldsOneLandmark) {
  std::mt19937_64 random(1);
  for (const double size : kSizes) {
    LandmarkMap map(64, size);
    std::vector<Vector3<double>> directions = hard_directions();
    for (int i = 0; i < 200; ++i) directions.push_back(anywhere(&random));
    for (const auto& d : directions) {
      for (int octave = 0; octave < LandmarkMap::kMaxOctaves; ++octave) {
        map.clear(size);
        int slot = -1;
        EXPECT_FALSE(map.cell_taken(d, octave));
        ASSERT_EQ(map.insert(landmark_at(d, octave), 0, &slot), InsertStatus::kOk);
        EXPECT_TRUE(map.cell_taken(d, octave));
        EXPECT_EQ(map.insert(landmark_at(d, octave), 0, &slot), InsertStatus::kCellTaken);
        const int other = (octave + 1) % LandmarkMap::kMaxOctaves;
        EXPECT_FALSE(map.cell_taken(d, other));
        EXPECT_EQ(map.insert(landmark_at(d, other), 0, &slot), InsertStatus::kOk);
        EXPECT_EQ(map.size(), 2);
        const double far = 4 * std::ldexp(size, octave);
        if (far < 3) {
          EXPECT_FALSE(map.cell_taken(near(d, far, &random), octave));
        }
      }
    }
  }
}

// Cells cover the sphere evenly: what fits on it follows from their size.
TEST(LandmarkMap, CellsOfAnOctaveAreAboutEqualEverywhere) {
  std::mt19937_64 random(2);
  constexpr double kSize = 0.1;
  LandmarkMap map(4096, kSize);
  for (int octave = 0; octave < 4; ++octave) {
    map.clear(kSize);
    int slot = 0;
    for (int i = 0; i < 100000; ++i) {
      const InsertStatus status = map.insert(landmark_at(anywhere(&random), octave), 0, &slot);
      ASSERT_TRUE(status == InsertStatus::kOk || status == InsertStatus::kCellTaken);
    }
    const double width = std::min(std::ldexp(kSize, octave), LandmarkMap::kMaxCellSize);
    const double expected = 4 * kPi / (width * width);
    EXPECT_NEAR(map.size() / expected, 1, octave < 3 ? 0.05 : 0.15) << octave;
    // The caps around the poles have as many as others of their size.
    const double cap = 3 * width;
    const double expected_in_cap = expected * (1 - std::cos(cap)) / 2;
    if (cap > 1.3) continue;
    for (const double pole : {-1.0, 1.0}) {
      const auto in_cap = find(map, pole * Vector3<double>::UnitZ(), std::cos(cap));
      EXPECT_NEAR(static_cast<double>(in_cap.size()) / expected_in_cap, 1, 0.25);
    }
  }
}

TEST(LandmarkMap, CellsOfCoarseOctavesGrowNoLargerThanAsked) {
  std::mt19937_64 random(9);
  constexpr double kSize = 0.1;
  constexpr double kLargest = 0.15;
  LandmarkMap map(4096, kSize, kLargest);
  for (const int octave : {0, 1, 7}) {
    map.clear(kSize, kLargest);
    int slot = 0;
    for (int i = 0; i < 50000; ++i) {
      const InsertStatus status = map.insert(landmark_at(anywhere(&random), octave), 0, &slot);
      ASSERT_TRUE(status == InsertStatus::kOk || status == InsertStatus::kCellTaken);
    }
    const double width = octave == 0 ? kSize : kLargest;
    EXPECT_NEAR(map.size() / (4 * kPi / (width * width)), 1, 0.05) << octave;
  }
}

TEST(LandmarkMap, AzimuthOfPlusAndMinusPiIsOneCell) {
  for (const double size : kSizes) {
    LandmarkMap map(4, size);
    int slot = -1;
    ASSERT_EQ(map.insert(landmark_at({-1, 0.0, 0}), 0, &slot), InsertStatus::kOk);
    EXPECT_EQ(map.insert(landmark_at({-1, -0.0, 0}), 0, &slot), InsertStatus::kCellTaken);
  }
}

TEST(LandmarkMap, FindsExactlyWhatASearchOfEverythingFinds) {
  // Three products and two sums, which a processor may fuse, or not: here and there in its own way.
  constexpr double kRounding = 5 * std::numeric_limits<double>::epsilon();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> exponent(-5, 0.49);
  std::size_t found = 0;
  std::size_t searches = 0;
  for (const int capacity : {1, 15, 16, 17, 500}) {
    const auto any_slot = [&] {
      return static_cast<int>(random() % static_cast<std::uint64_t>(capacity));
    };
    for (const double spread : {1e-5, 1e-3, 0.05, 1.0}) {
      LandmarkMap map(capacity, 1e-5);
      fill(&map, 2 * capacity, spread, &random);
      for (const auto& d : hard_directions()) {
        int slot = 0;
        if (map.size() > capacity / 2) map.retire(any_slot());
        (void)map.insert(landmark_at(d, 7), 0, &slot);
      }
      std::vector<Vector3<double>> centres = hard_directions();
      for (int i = 0; i < 100; ++i) {
        const int slot = any_slot();
        if (!map.occupied(slot)) continue;
        centres.push_back(map.at(slot).d);
        centres.push_back(near(map.at(slot).d, std::pow(10, exponent(random)), &random));
        centres.push_back(-map.at(slot).d);
      }
      for (const auto& centre : centres) {
        std::vector<double> cosines = {1, 0, -1, -0.999, std::cos(std::pow(10, exponent(random)))};
        // So near the limit that rounding to float decides wrongly half of the times, and on it.
        for (int i = 0; i < 5; ++i) {
          const int slot = any_slot();
          if (!map.occupied(slot)) continue;
          for (const double beside : {-1e-14, 0.0, 1e-14}) {
            const double cosine = centre.normalized().dot(map.at(slot).d) + beside;
            cosines.push_back(std::clamp(cosine, -1.0, 1.0));
          }
        }
        for (const double cosine : cosines) {
          const bool all = cosine <= -1;
          const auto surely = plain_find(map, centre.normalized(), all ? -2 : cosine + kRounding);
          const auto perhaps = plain_find(map, centre.normalized(), all ? -2 : cosine - kRounding);
          const auto slots = find(map, centre, cosine);
          ASSERT_TRUE(std::includes(slots.begin(), slots.end(), surely.begin(), surely.end()) &&
                      std::includes(perhaps.begin(), perhaps.end(), slots.begin(), slots.end()))
              << "cosine " << cosine << ", centre " << centre.transpose();
          found += slots.size();
          ++searches;
        }
      }
    }
  }
  EXPECT_GT(searches, 10000U);
  EXPECT_GT(found, 10 * searches);
}

TEST(LandmarkMap, FindsNothingAtAnAngleThatIsNone) {
  LandmarkMap map(4, 0.1);
  int slot = 0;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double cosine : {static_cast<double>(NAN), kInfinity, -kInfinity, 1.1, -1.1}) {
    EXPECT_THAT(find(map, Vector3<double>::UnitX(), cosine), testing::IsEmpty()) << cosine;
  }
  EXPECT_THAT(find(map, Vector3<double>::UnitX(), -1), testing::ElementsAre(slot));
}

TEST(LandmarkMap, CountsButDoesNotWriteWhatFindHasNoRoomFor) {
  std::mt19937_64 random(4);
  LandmarkMap map(100, 1e-3);
  fill(&map, 300, 0.5, &random);
  ASSERT_EQ(map.size(), 100);
  std::vector<int> slots(11, -1);
  EXPECT_EQ(map.find(Vector3<double>::UnitY(), -1, slots.data(), 10), 100);
  EXPECT_THAT(slots, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, -1));
  EXPECT_EQ(map.find(Vector3<double>::UnitY(), -1, nullptr, 0), 100);
}

TEST(LandmarkMap, RefinedLandmarkIsFoundAtItsNewPlaceAndKeepsItsCell) {
  LandmarkMap map(4, 0.1);
  std::mt19937_64 random(5);
  const Vector3<double> before = anywhere(&random);
  const Vector3<double> after = near(before, 0.5, &random);
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(before), 0, &slot), InsertStatus::kOk);
  Matrix2<double> covariance;
  covariance << 2, 1, 1, 3;
  map.refine(slot, after, covariance);
  EXPECT_LE((map.at(slot).d - after).norm(), 1e-15);
  EXPECT_EQ(map.at(slot).covariance, covariance);
  EXPECT_THAT(find(map, after, std::cos(1e-3)), testing::ElementsAre(slot));
  EXPECT_THAT(find(map, before, std::cos(1e-3)), testing::IsEmpty());
  EXPECT_TRUE(map.cell_taken(before, 0));
  EXPECT_FALSE(map.cell_taken(after, 0));
  for (const Vector3<double>& bad : {Vector3<double>(NAN, 0, 0), Vector3<double>(0, 0, 0)}) {
    map.refine(slot, bad, Matrix2<double>::Zero());
    EXPECT_LE((map.at(slot).d - after).norm(), 1e-15);
    EXPECT_EQ(map.at(slot).covariance, covariance);
  }
  map.retire(slot);
  EXPECT_FALSE(map.cell_taken(before, 0));
}

TEST(LandmarkMap, FullMapOfUsefulLandmarksKeepsThem) {
  std::mt19937_64 random(6);
  LandmarkMap map(50, 1e-3);
  fill(&map, 200, 1, &random);
  ASSERT_EQ(map.size(), 50);
  int slot = -1;
  // New ones of the same frame and of the one after.
  EXPECT_EQ(map.insert(landmark_at(anywhere(&random), 3), 0, &slot), InsertStatus::kFull);
  EXPECT_EQ(map.insert(landmark_at(anywhere(&random), 3), 1, &slot), InsertStatus::kFull);
  for (int i = 0; i < 50; ++i) {
    map.statistics(i).looked_for = 100;
    map.statistics(i).matched = 95;
    map.statistics(i).last_frame = 100;
  }
  EXPECT_EQ(map.insert(landmark_at(anywhere(&random), 3), 110, &slot), InsertStatus::kFull);
  EXPECT_EQ(slot, -1);
  EXPECT_EQ(map.replaced(), 0);
}

TEST(LandmarkMap, FullMapGivesUpTheLeastUseful) {
  std::mt19937_64 random(7);
  LandmarkMap map(50, 1e-3);
  fill(&map, 200, 1, &random);
  ASSERT_EQ(map.size(), 50);
  constexpr std::uint32_t kNow = 1000;
  for (int i = 0; i < 50; ++i) {
    map.statistics(i).looked_for = 100;
    map.statistics(i).matched = 90;
    map.statistics(i).last_frame = kNow;
  }
  map.statistics(31).matched = 3;              // hardly ever found
  map.statistics(17).last_frame = kNow - 800;  // long not looked for
  map.statistics(42).matched = 40;             // found less than every second time
  const std::vector<int> order = {31, 17, 42};
  std::set<std::uint32_t> ids;
  for (int i = 0; i < 50; ++i) ids.insert(map.at(i).id);
  std::vector<int> given;
  for (int i = 0; i < 3; ++i) {
    const Vector3<double> gone = map.at(order[static_cast<std::size_t>(i)]).d;
    int slot = -1;
    ASSERT_EQ(map.insert(landmark_at(anywhere(&random), 3), kNow, &slot), InsertStatus::kOk);
    given.push_back(slot);
    EXPECT_THAT(find(map, gone, 1 - 1e-12), testing::Not(testing::Contains(slot)));
    EXPECT_TRUE(ids.insert(map.at(slot).id).second);
    EXPECT_EQ(map.size(), 50);
    EXPECT_EQ(map.replaced(), i + 1);
  }
  EXPECT_EQ(given, order);
  int slot = -1;
  EXPECT_EQ(map.insert(landmark_at(anywhere(&random), 3), kNow, &slot), InsertStatus::kFull);
  map.clear(1e-3);
  EXPECT_EQ(map.replaced(), 0) << "since then";
}

// A camera that turns on and on makes landmarks for ever; the map must follow it.
TEST(LandmarkMap, FullMapForgetsWhatWasSeenLongAgoForWhatIsSeenNow) {
  LandmarkMap map(400, 0.01);
  for (std::uint32_t frame = 0; frame < 2000; ++frame) {
    int slot = -1;
    // One new a frame; each stays in view, and is found, for 30 frames.
    const Vector3<double> d = from_angles(0.011 * frame, 0.5 + 0.2 * (frame % 11));
    const InsertStatus status = map.insert(landmark_at(d), frame, &slot);
    ASSERT_NE(status, InsertStatus::kFull) << frame;
    for (int i = 0; i < map.capacity(); ++i) {
      if (!map.occupied(i) || map.statistics(i).looked_for >= 30) continue;
      ++map.statistics(i).looked_for;
      ++map.statistics(i).matched;
      map.statistics(i).last_frame = frame;
    }
  }
  EXPECT_EQ(map.size(), 400);
  EXPECT_GT(map.replaced(), 1000);
}

TEST(LandmarkMap, WorthFallsWithMissesAndWithTimeButNotForASecond) {
  LandmarkMap map(4, 0.1);
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 100, &slot), InsertStatus::kOk);
  const double fresh = map.worth(slot, 100);
  EXPECT_EQ(map.worth(slot, 120), fresh);
  EXPECT_LT(map.worth(slot, 200), fresh);
  EXPECT_EQ(map.worth(slot, 90), fresh);  // a frame before: no time has passed
  map.statistics(slot).looked_for = 10;
  map.statistics(slot).matched = 10;
  const double good = map.worth(slot, 100);
  EXPECT_GT(good, fresh);
  map.statistics(slot).matched = 5;
  EXPECT_LT(map.worth(slot, 100), good);
  map.statistics(slot).matched = 1;
  EXPECT_LT(map.worth(slot, 100), fresh);
  map.statistics(slot).looked_for = 1000;
  map.statistics(slot).matched = 1000;
  EXPECT_GT(map.worth(slot, 400), 3 * good * 30 / 300);  // often found, later forgotten
  EXPECT_LE(map.worth(slot, 100), 1);
  // The count of frames wraps.
  map.statistics(slot).last_frame = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(map.worth(slot, 9), map.worth(slot, std::numeric_limits<std::uint32_t>::max()));
}

// However often it was found: after twice four times the shortest memory half its worth is gone.
TEST(LandmarkMap, ForgetsEvenWhatWasFoundAThousandTimes) {
  LandmarkMap map(4, 0.1);
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  for (const std::uint32_t found : {100U, 1000U, 100000U}) {
    map.statistics(slot).looked_for = found;
    map.statistics(slot).matched = found;
    EXPECT_LE(map.worth(slot, 2 * 4 * 30), 0.5 * map.worth(slot, 0)) << found;
  }
}

TEST(LandmarkMap, WorthFallsWithAgeWhereTheCountOfFramesWrapsAsItDoesElsewhere) {
  LandmarkMap map(4, 0.1);
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  for (const std::uint32_t age : {20U, 200U, 2000U, 20000U}) {
    map.statistics(slot).last_frame = 1000;
    const double expected = map.worth(slot, 1000 + age);
    for (const std::uint32_t before : {1U, 10U, 150U}) {
      map.statistics(slot).last_frame = 0U - before;
      EXPECT_EQ(map.worth(slot, age - before), expected) << age << " frames, " << before;
    }
  }
}

// Directions of a coarse grid, so that cells are often the same; few buckets, so that entries of the
// hash table collide.
TEST(LandmarkMap, AgreesWithAPlainModelOverManyInsertionsAndRetirements) {
  std::mt19937_64 random(8);
  constexpr int kCapacity = 300;
  constexpr double kSize = 0.1;
  LandmarkMap map(kCapacity, kSize);
  std::vector<Vector3<double>> directions = hard_directions();
  while (directions.size() < 400) directions.push_back(anywhere(&random));
  // Which of them share a cell: asked of a map that holds one landmark at a time.
  std::map<std::pair<int, int>, int> cell;  // octave, index of direction
  LandmarkMap single(1, kSize);
  for (int octave = 0; octave < 2; ++octave) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      single.clear(kSize);
      int slot = 0;
      ASSERT_EQ(single.insert(landmark_at(directions[i], octave), 0, &slot), InsertStatus::kOk);
      std::size_t first = 0;
      while (!single.cell_taken(directions[first], octave)) ++first;
      cell[{octave, static_cast<int>(i)}] = static_cast<int>(first);
    }
  }
  struct Held {
    int slot = 0;
    std::uint32_t id = 0;
  };
  std::map<std::pair<int, int>, Held> model;  // octave, first direction of the cell
  std::set<std::uint32_t> ids;
  std::int64_t inserted = 0;
  std::int64_t refused = 0;
  std::int64_t retired = 0;
  for (int i = 0; i < 100000; ++i) {
    const int octave = static_cast<int>(random() % 2);
    const auto index = static_cast<int>(random() % directions.size());
    const auto key = std::pair(octave, cell[{octave, index}]);
    const auto held = model.find(key);
    const Vector3<double>& d = directions[static_cast<std::size_t>(index)];
    ASSERT_EQ(map.cell_taken(d, octave), held != model.end());
    // Phases of growing and of shrinking.
    if (random() % 100 < (i / 2000 % 2 == 0 ? 80U : 30U)) {
      int slot = -1;
      const InsertStatus status = map.insert(landmark_at(d, octave), 0, &slot);
      if (held != model.end()) {
        ASSERT_EQ(status, InsertStatus::kCellTaken);
        ++refused;
      } else if (model.size() == kCapacity) {
        ASSERT_EQ(status, InsertStatus::kFull);
      } else {
        ASSERT_EQ(status, InsertStatus::kOk);
        ASSERT_TRUE(map.occupied(slot));
        ASSERT_TRUE(ids.insert(map.at(slot).id).second);
        model[key] = {slot, map.at(slot).id};
        ++inserted;
      }
    } else if (held != model.end()) {
      ASSERT_EQ(map.at(held->second.slot).id, held->second.id);
      map.retire(held->second.slot);
      ASSERT_FALSE(map.occupied(held->second.slot));
      model.erase(held);
      ++retired;
    }
    ASSERT_EQ(map.size(), static_cast<int>(model.size()));
    if (i % 1000 != 0) continue;
    std::vector<int> slots;
    for (const auto& [place, value] : model) {
      slots.push_back(value.slot);
      ASSERT_EQ(map.at(value.slot).id, value.id);
      ASSERT_EQ(map.at(value.slot).octave, place.first);
    }
    std::sort(slots.begin(), slots.end());
    ASSERT_EQ(find(map, Vector3<double>::UnitX(), -1), slots);
  }
  EXPECT_GT(inserted, 10000);
  EXPECT_GT(refused, 10000);
  EXPECT_GT(retired, 10000);
}

TEST(LandmarkMap, RetiringAFreeSlotChangesNothing) {
  LandmarkMap map(4, 0.1);
  int slot = -1;
  ASSERT_EQ(map.insert(landmark_at(Vector3<double>::UnitX()), 0, &slot), InsertStatus::kOk);
  for (int other = -1; other <= 4; ++other) {
    if (other != slot) map.retire(other);
  }
  EXPECT_EQ(map.size(), 1);
  map.retire(slot);
  map.retire(slot);
  EXPECT_EQ(map.size(), 0);
}

}  // namespace
}  // namespace alidade::test

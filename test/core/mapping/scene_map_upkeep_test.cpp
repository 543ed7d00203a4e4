#include "core/mapping/scene_map_upkeep.h"
#include "core/mapping/map_projection.h"

#include <gtest/gtest.h>

#include <set>

#include "core/mapping/sphere_cell.h"
#include "test/core/mapping/changing_scene.h"
#include "test/core/mapping/random_scene_map.h"

namespace alidade::test {
namespace {

constexpr double kFocalLength = 1500;
constexpr double kNow = 1.7e9;

// A camera at rest before things on a grid, which are all landmarks; further things by hand. Everything is seen without noise.
class UpkeepTest : public ::testing::Test {
 protected:
  UpkeepTest() {
    map.lens = LensCurve::of({kFocalLength, 1, {0}, 1280, 720, 0, 0});
    map.reference_row = 360;
    for (int i = 0; i < 24; ++i) {
      SceneLandmark landmark = landmark_at({200.0 + 160 * (i % 6), 120.0 + 160 * (i / 6)}, i);
      landmark.id = map.next_landmark++;
      map.landmarks.push_back(landmark);
    }
  }

  SceneLandmark landmark_at(const Vector2<double>& u, int looks) {
    SceneLandmark out;
    EXPECT_EQ(unproject_to_map(map.lens.camera_of(std::log(kFocalLength)), {}, R, u, &out.d_b),
              ProjectionStatus::kOk);
    const double sigma = 0.1 / kFocalLength;
    out.covariance = sigma * sigma * Matrix2<double>::Identity();
    out.scale_rad = 3 / kFocalLength;
    out.focal_length_px = kFocalLength;
    out.descriptor = descriptor(looks);
    out.life = {kNow - 100, kNow - 100, 20, 18};
    return out;
  }
  static Descriptor descriptor(int looks) {
    std::mt19937_64 random(static_cast<std::uint64_t>(looks));
    Descriptor out{};
    for (std::uint8_t& x : out) x = static_cast<std::uint8_t>(random() % 80);
    return out;
  }

  // Shows the landmarks with these ids (all: those of the grid), and things at these places.
  MapChange show(const std::set<std::int64_t>& ids, const std::vector<Vector2<double>>& things,
                 double after_s) {
    FeatureSet seen;
    UpkeepView view;
    view.time_utc_s = kNow + after_s;
    view.R_base_from_camera = R;
    view.log_f = std::log(kFocalLength);
    view.covariance = 1e-10 * Matrix4<double>::Identity();
    for (const SceneLandmark& landmark : map.landmarks) {
      if (ids.count(landmark.id) == 0) continue;
      MapProjection p;
      EXPECT_EQ(project_from_map(map.lens.camera_of(view.log_f), {}, R, 0, landmark.d_b, &p),
                ProjectionStatus::kOk);
      view.matches.push_back({static_cast<int>(seen.size()), landmark.id});
      seen.features.push_back({p.u, 3, 0, 0.1});
      seen.descriptors.push_back(landmark.descriptor);
    }
    for (std::size_t i = 0; i < things.size(); ++i) {
      seen.features.push_back({things[i], 3, 0, 0.1});
      seen.descriptors.push_back(descriptor(1000 + static_cast<int>(i)));
    }
    view.features = &seen;
    const MapChange change = upkeep.show(view, map, &counts);
    std::string error;
    EXPECT_TRUE(apply(change, &map, &error)) << error;
    EXPECT_TRUE(is_valid(map, &error)) << error;
    return change;
  }
  [[nodiscard]] std::set<std::int64_t> grid() const {
    std::set<std::int64_t> out;
    for (std::int64_t id = 1; id <= 24; ++id) out.insert(id);
    return out;
  }

  Matrix3<double> R = r_frd_from_rdf<double>();
  SceneMap map;
  SceneMapUpkeep upkeep;
  UpkeepCounts counts;
};

TEST_F(UpkeepTest, WhatIsSeenBecomesSurer) {
  const SceneLandmark before = map.landmarks[3];
  for (int i = 0; i < 5; ++i) show(grid(), {}, i);
  const SceneLandmark& after = map.landmarks[3];
  EXPECT_EQ(counts.updated, 24);
  EXPECT_EQ(counts.expected, 24);
  EXPECT_LT(after.covariance.trace(), before.covariance.trace());
  EXPECT_GT(after.shared_covariance.trace(), 0);
  EXPECT_EQ(after.life.matched, before.life.matched + 5);
  EXPECT_EQ(after.life.last_seen_utc_s, kNow + 4);
}

TEST_F(UpkeepTest, PicturesThatFollowOneAnotherSayHardlyMoreThanOne) {
  show(grid(), {}, 0);
  const double once = map.landmarks[3].covariance.trace();
  for (int i = 1; i <= 20; ++i) show(grid(), {}, i);
  EXPECT_NEAR(map.landmarks[3].covariance.trace(), once, 0.01 * once);
  for (int i = 1; i <= 5; ++i) show(grid(), {}, 20 + upkeep.options().lasting_s * i);
  EXPECT_LT(map.landmarks[3].covariance.trace(), 0.8 * once);
}

TEST_F(UpkeepTest, NoNumberOfPicturesMakesALandmarkSurerThanTheLeastSigma) {
  for (int i = 0; i < 300; ++i) show(grid(), {}, i);
  const double least = upkeep.options().least_sigma_px / kFocalLength;
  EXPECT_GE(map.landmarks[3].covariance(0, 0), least * least * (1 - 1e-9));
}

TEST_F(UpkeepTest, AThingIsBornAfter20PicturesRunning) {
  const Vector2<double> thing(530, 333);
  for (int i = 0; i < 19; ++i) {
    EXPECT_TRUE(show(grid(), {thing}, i).born.empty()) << i;
  }
  const MapChange change = show(grid(), {thing}, 19);
  ASSERT_EQ(change.born.size(), 1U);
  const SceneLandmark& born = map.landmarks.back();
  const SceneLandmark truth = landmark_at(thing, 1000);
  EXPECT_EQ(born.id, 25);
  EXPECT_LT(direction_minus(born.d_b, truth.d_b).norm() * kFocalLength, 1e-6);
  EXPECT_NEAR(born.scale_rad, truth.scale_rad, 1e-9);
  // 20 pictures in 20 s say little more than one.
  const double sigma_px = std::sqrt(born.covariance(0, 0)) * kFocalLength;
  EXPECT_NEAR(sigma_px, upkeep.options().sigma_of(3), 0.1 * upkeep.options().sigma_of(3));
  EXPECT_EQ(upkeep.candidates(), 0);
}

TEST_F(UpkeepTest, AThingThatIsMissingOnceBeginsAnew) {
  const Vector2<double> thing(530, 333);
  for (int i = 0; i < 38; ++i) {
    EXPECT_TRUE(show(grid(),
                     i == 19 ? std::vector<Vector2<double>>{} : std::vector<Vector2<double>>{thing},
                     i)
                    .born.empty())
        << i;
  }
}

TEST_F(UpkeepTest, AThingThatFogHidesGoesOnAfterIt) {
  const Vector2<double> thing(530, 333);
  int i = 0;
  for (; i < 10; ++i) show(grid(), {thing}, i);
  for (; i < 15; ++i) {
    show({1, 6, 19, 24}, {}, i);
    ASSERT_TRUE(counts.all_hidden);
  }
  for (; i < 24; ++i) EXPECT_TRUE(show(grid(), {thing}, i).born.empty()) << i;
  EXPECT_EQ(show(grid(), {thing}, i).born.size(), 1U);
}

TEST_F(UpkeepTest, AThingThatMovesIsNotBorn) {
  for (int i = 0; i < 60; ++i) {
    EXPECT_TRUE(show(grid(), {{300.0 + 3 * i, 333}}, i).born.empty()) << i;
  }
}

TEST_F(UpkeepTest, FarFromTheMatchedLandmarksNothingIsBorn) {
  // Matched on the left, the thing far on the right: the box has less than half of the one with it.
  std::set<std::int64_t> left;
  for (const std::int64_t id : grid()) {
    if ((id - 1) % 6 < 3) left.insert(id);
  }
  for (int i = 0; i < 25; ++i) EXPECT_TRUE(show(left, {{1150, 333}}, i).born.empty()) << i;
  EXPECT_EQ(counts.not_close, 1);
  // Once the landmarks about it are found, it is.
  EXPECT_EQ(show(grid(), {{1150, 333}}, 25).born.size(), 1U);
}

TEST_F(UpkeepTest, WhatIsGoneDiesAfterItsPatience) {
  std::set<std::int64_t> others = grid();
  others.erase(7);
  int views = 0;
  double t = 0;
  for (; landmark_index(map, 7) >= 0; t += 3600) {
    ASSERT_LT(++views, 100);
    show(others, {}, t);
  }
  // Last seen 100 s before the first picture.
  EXPECT_EQ(views, static_cast<int>(std::ceil((2.5 * 86400 - 100) / 3600)) + 1);
  EXPECT_EQ(map.landmarks.size(), 23U);
  EXPECT_EQ(counts.died, 1);
}

TEST_F(UpkeepTest, NoLandmarkIsGuiltyOfFog) {
  const std::vector<SceneLandmark> before = map.landmarks;
  for (int i = 0; i < 110; ++i) {
    show({1, 6, 19, 24}, {}, 3600.0 * i);
    EXPECT_TRUE(counts.all_hidden);
  }
  EXPECT_EQ(map.landmarks.size(), 24U);
  EXPECT_EQ(map.landmarks[8].life.looked_for, before[8].life.looked_for);
}

TEST_F(UpkeepTest, AWholeSceneThatIsReplacedIsNotTakenForFogForever) {
  // All but a few things are exchanged at once.
  std::vector<Vector2<double>> things;
  for (int i = 0; i < 20; ++i) things.emplace_back(230.0 + 170 * (i % 5), 150.0 + 130 * (i / 5));
  std::set<std::int64_t> seen{1, 6, 19, 24};
  for (int i = 0; i < 200; ++i) {
    const MapChange change =
        show(seen, i < 20 ? things : std::vector<Vector2<double>>{}, 3600.0 * i);
    for (const SceneLandmark& landmark : change.born) seen.insert(landmark.id);
  }
  EXPECT_EQ(map.landmarks.size(), 24U);
  EXPECT_EQ(landmark_index(map, 7), -1);
}

TEST_F(UpkeepTest, ManyThatAreGoneDoNotHideTheirOwnDeath) {
  // Five cars come and go, each with more things than the rest of the scene; each is there for 25 pictures.
  double t = 0;
  for (int car = 0; car < 5; ++car) {
    std::vector<Vector2<double>> things;
    for (int i = 0; i < 30; ++i) {
      things.emplace_back(230.0 + 14 * car + 150 * (i % 6), 130.0 + 10 * car + 100 * (i / 6));
    }
    std::set<std::int64_t> seen = grid();
    for (int i = 0; i < 25; ++i, t += 60) {
      const MapChange change = show(seen, i < 20 ? things : std::vector<Vector2<double>>{}, t);
      for (const SceneLandmark& landmark : change.born) seen.insert(landmark.id);
    }
    EXPECT_GT(seen.size(), 40U);
  }
  EXPECT_GT(map.landmarks.size(), 120U);
  // Another program goes on with the map.
  upkeep = SceneMapUpkeep();
  for (int i = 0; i < 150; ++i, t += 3600) show(grid(), {}, t);
  EXPECT_EQ(map.landmarks.size(), 24U);
}

TEST_F(UpkeepTest, ACellHoldsSoManyAndTheLeastUsefulGoes) {
  // Four things in one spot of 20 scales: the first three are born.
  const std::vector<Vector2<double>> things{{600, 330}, {606, 330}, {600, 336}, {606, 336}};
  for (int i = 0; i < 20; ++i) show(grid(), things, i);
  std::map<std::uint64_t, int> cells;
  for (const SceneLandmark& l : map.landmarks) ++cells[sphere_cell(l.d_b, l.scale_rad, 20)];
  for (const auto& [cell, count] : cells) EXPECT_LE(count, upkeep.options().cell_capacity);
}

TEST_F(UpkeepTest, AFullMapGivesUpTheLeastUseful) {
  SceneMapUpkeepOptions options;
  options.most_landmarks = 24;
  upkeep = SceneMapUpkeep(options);
  map.landmarks[10].life.matched = 1;
  std::set<std::int64_t> others = grid();
  others.erase(11);
  for (int i = 0; i < 20; ++i) show(others, {{530, 333}, {700, 333}}, i);
  EXPECT_EQ(map.landmarks.size(), 24U);
  EXPECT_GE(landmark_index(map, 25), 0);
  EXPECT_EQ(landmark_index(map, 26), -1) << "all others are worth more than something new";
  EXPECT_EQ(landmark_index(map, 11), -1);
}

TEST_F(UpkeepTest, EqualPicturesGiveEqualMaps) {
  const auto run = [] {
    ChangingSceneOptions what;
    what.days = 1;
    what.places = 1;
    what.round_s = 3 * 3600;
    return live_through(what, {});
  };
  const std::vector<SceneDay> one = run(), other = run();
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].error_px, other[0].error_px);
  EXPECT_EQ(one[0].born, other[0].born);
  EXPECT_GT(one[0].born, 0);
}

TEST_F(UpkeepTest, WhatCannotBeIsRefused) {
  UpkeepView view;
  EXPECT_TRUE(upkeep.show(view, map, &counts).empty());
  EXPECT_TRUE(counts.refused);
  FeatureSet seen;
  seen.features.resize(2);
  seen.descriptors.resize(2);
  view.features = &seen;
  view.R_base_from_camera = R;
  view.log_f = std::log(kFocalLength);
  for (const std::vector<UpkeepMatch>& matches : std::vector<std::vector<UpkeepMatch>>{
           {{2, 1}}, {{-1, 1}}, {{0, 77}}, {{0, 1}, {0, 2}}, {{0, 1}, {1, 1}}}) {
    view.matches = matches;
    EXPECT_TRUE(upkeep.show(view, map, &counts).empty());
    EXPECT_TRUE(counts.refused);
  }
  view.matches.clear();
  view.log_f = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(upkeep.show(view, map, &counts).empty());
  EXPECT_TRUE(counts.refused);
}

TEST(Descriptors, ADifferenceOfLessThanAStepIsNotLost) {
  Descriptor average{}, seen{};
  average.fill(45);
  seen.fill(45);
  seen[5] = 48;
  seen[6] = 42;
  for (std::uint64_t i = 0; i < 300; ++i) average_descriptor(seen, 0.1, 1000 * i, &average);
  EXPECT_NEAR(average[5], 48, 1);
  EXPECT_NEAR(average[6], 42, 1);
  EXPECT_NEAR(average[7], 45, 1);
}

// Their distances are compared with bounds that are for descriptors of one length.
TEST(Descriptors, AnAverageIsAsLongAsThoseItIsOf) {
  Descriptor average{}, seen{};
  for (std::size_t i = 0; i < average.size(); ++i) (i % 2 == 0 ? average : seen)[i] = 64;
  average_descriptor(seen, 0.5, 1, &average);
  double square = 0;
  for (const int value : average) square += value * value;
  // 64 values of 64 each; each is rounded by less than one.
  EXPECT_NEAR(std::sqrt(square), 64 * 8, std::sqrt(128.0));
}

TEST(SphereCell, CellsAreOfTheSizeThatWasAskedFor) {
  // Random directions in a cap; neighbours nearer than a tenth of a side share a cell nine times in ten or so, those two sides apart never.
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const double scale = 0.001, side = 20 * std::ldexp(1.0, std::ilogb(scale));
  int same = 0;
  constexpr int kPairs = 2000;
  for (int i = 0; i < kPairs; ++i) {
    const Vector3<double> d =
        Vector3<double>(normal(random), normal(random), normal(random)).normalized();
    const double angle = 2 * kPi * i / kPairs;
    const Vector2<double> way(std::cos(angle), std::sin(angle));
    const std::uint64_t cell = sphere_cell(d, scale, 20);
    same += cell == sphere_cell(direction_plus<double>(d, 0.1 * side * way), scale, 20) ? 1 : 0;
    EXPECT_NE(cell, sphere_cell(direction_plus<double>(d, 2.2 * side * way), scale, 20));
    EXPECT_NE(cell, sphere_cell(d, 2.1 * scale, 20));
  }
  // A step of a tenth in a random direction leaves a square in 2 x 0.0637 - 0.004 of all cases.
  EXPECT_NEAR(same, 0.877 * kPairs, 5 * std::sqrt(kPairs * 0.877 * 0.123) + 0.02 * kPairs);
}

TEST(SphereCell, ARingHasAsManyCellsAsItsAreaHolds) {
  const double scale = 0.001, side = 20 * std::ldexp(1.0, std::ilogb(scale));
  for (const int ring : {0, 1, 2, 5, 20, 60, 80}) {
    const double from_pole = (ring + 0.5) * side;
    std::set<std::uint64_t> cells;
    constexpr int kLooks = 20'000;
    for (int i = 0; i < kLooks; ++i) {
      const double turn = 2 * kPi * i / kLooks;
      cells.insert(sphere_cell({std::sin(from_pole) * std::cos(turn),
                                std::sin(from_pole) * std::sin(turn), std::cos(from_pole)},
                               scale, 20));
    }
    // In sides squared. The ring is curved: 1 - side^2 / 24 of its middle's length times its width.
    const double area =
        2 * kPi * (std::cos(ring * side) - std::cos((ring + 1) * side)) / (side * side);
    EXPECT_LE(static_cast<double>(cells.size()), area * (1 + side * side)) << ring;
    EXPECT_GT(static_cast<double>(cells.size() + 1), area) << ring;
  }
}

TEST(SceneMapUpkeep, TwoDaysLeaveTheDirectionWhereItWas) {
  ChangingSceneOptions what;
  what.days = 2;
  what.places = 1;
  what.round_s = 3 * 3600;
  const std::vector<SceneDay> days = live_through(what, {});
  ASSERT_EQ(days.size(), 2U);
  EXPECT_LT(days[1].drift_px, 0.1);
  EXPECT_LT(days[1].error_px, 0.2);
  EXPECT_GT(days[1].matches, 60);
  EXPECT_LT(days[1].landmarks, 1000);
  SceneRunOptions without;
  without.upkeep = false;
  EXPECT_LT(live_through(what, without)[1].matches, days[1].matches - 10);
}

}  // namespace
}  // namespace alidade::test

#include "core/realtime/oe_mode/scene_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "core/realtime/oe_mode/moving_directions.h"

namespace alidade {
namespace {

constexpr double kPixel = 1e-4;  // rad
constexpr double kFrame_s = 0.04;
constexpr int kLandmarks = 100;

// Landmarks before a camera that looks ahead. The map follows those that `followed` says; all of
// one kind move at `cloud_px_s` to the right.
struct World {
  double cloud_px_s = 1;
  double telemetry_px = 0.3;
  int clouds = 60;  // of the landmarks
  bool map_follows_clouds = true;
  std::function<double(double)> telemetry_error_px = [](double) { return 0.0; };  // of pan
};

class Film {
 public:
  Film(const World& world, std::uint64_t seed, SceneDrift* drift)
      : world_(world), generator_(seed), drift_(drift) {}

  // The next frame; ids of landmarks begin at first_id.
  SceneVerdict frame(std::uint32_t first_id = 0) {
    const double t = kFrame_s * count_++;
    // The map turns with the clouds: telemetry minus map goes the other way.
    const double cloud = kPixel * world_.cloud_px_s * t;
    const double map = world_.map_follows_clouds ? cloud : 0;
    SeenOffset seen;
    seen.time_s = t;
    const double sigma = kPixel * world_.telemetry_px;
    // A camera at rest; clouds that go to the right look like a camera that turns to the left.
    seen.offset = {map + kPixel * world_.telemetry_error_px(t) + sigma * normal_(generator_),
                   sigma * normal_(generator_)};
    seen.variance.setConstant(sigma * sigma);
    drift_->note(seen);
    drift_->begin_frame(t, Vector2<double>::Zero());
    for (int i = 0; i < kLandmarks; ++i) {
      const bool is_cloud = i < world_.clouds;
      const double azimuth = 0.003 * (i % 10) + (is_cloud ? cloud : 0) - map;
      const double elevation = 0.003 * static_cast<double>(i / 10);
      const double noise = 0.05 * kPixel;
      const double a = azimuth + noise * normal_(generator_);
      const double e = elevation + noise * normal_(generator_);
      const Vector3<double> d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), -std::sin(e));
      drift_->note_landmark(i, first_id + static_cast<std::uint32_t>(i) + 1, d);
    }
    return drift_->judge(kPixel);
  }
  // Frames until a verdict is not kRest or kUndecided; *undecided counts the latter.
  SceneVerdict until_decided(int frames, int* undecided) {
    for (int i = 0; i < frames; ++i) {
      const SceneVerdict verdict = frame();
      if (verdict == SceneVerdict::kUndecided) {
        ++*undecided;
      } else if (verdict != SceneVerdict::kRest) {
        return verdict;
      }
    }
    return SceneVerdict::kRest;
  }
  [[nodiscard]] double time_s() const { return kFrame_s * count_; }

 private:
  World world_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  SceneDrift* drift_;
  int count_ = 0;
};

TEST(SceneDrift, FindsNothingWhereAllStandsStill) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SceneDrift drift(kLandmarks);
    World world;
    world.cloud_px_s = 0;
    Film film(world, seed, &drift);
    for (int i = 0; i < 500; ++i) {
      ASSERT_EQ(film.frame(), SceneVerdict::kRest) << seed << ", frame " << i;
      ASSERT_FALSE(drift.withholds());
    }
  }
}

TEST(SceneDrift, TellsTheGroundFromCloudsBeItTheMinority) {
  for (const bool follows_clouds : {true, false}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      SceneDrift drift(kLandmarks);
      World world;
      world.map_follows_clouds = follows_clouds;
      // What is apart is the lesser part.
      world.clouds = follows_clouds ? 60 : 40;
      Film film(world, seed, &drift);
      int undecided = 0;
      EXPECT_EQ(film.until_decided(75, &undecided),
                follows_clouds ? SceneVerdict::kMapMoves : SceneVerdict::kPartMoves)
          << seed;
      EXPECT_LT(film.time_s(), 2.5);
      int moving = 0;
      int wrong = 0;
      drift.for_each_moving(
          [&](int slot, std::uint32_t, const Vector3<double>&, const Vector2<double>& rate) {
            wrong += slot < world.clouds ? 0 : 1;
            // The camera would turn to the left. Telemetry has just told that it does.
            EXPECT_LT(rate.x(), -0.3 * kPixel);
            ++moving;
          });
      EXPECT_GE(moving, world.clouds * 9 / 10);
      // After half a second some of the ground may be with them.
      EXPECT_LE(wrong, 4);
    }
  }
}

TEST(SceneDrift, ClaimsNothingBeforeTelemetryTells) {
  SceneDrift drift(kLandmarks);
  World world;
  world.telemetry_px = 30;
  Film film(world, 1, &drift);
  int undecided = 0;
  EXPECT_EQ(film.until_decided(75, &undecided), SceneVerdict::kRest);
  EXPECT_GT(undecided, 50);
  EXPECT_TRUE(drift.withholds());
}

TEST(SceneDrift, PutsWhatFollowsOnTrialWhereAllMoved) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SceneDrift drift(kLandmarks);
    World sky;
    sky.clouds = kLandmarks;
    Film film(sky, seed, &drift);
    int undecided = 0;
    ASSERT_EQ(film.until_decided(100, &undecided), SceneVerdict::kAllMove) << seed;
    EXPECT_EQ(undecided, 0);
    // More sky: nothing is claimed.
    drift.begin_map();
    Film more(sky, seed + 100, &drift);
    SceneVerdict verdict = SceneVerdict::kRest;
    for (int i = 0; i < 100 && verdict == SceneVerdict::kRest; ++i) {
      verdict = more.frame();
      ASSERT_TRUE(drift.withholds()) << seed << ", frame " << i;
    }
    EXPECT_EQ(verdict, SceneVerdict::kAllMove);
    // A roof.
    drift.begin_map();
    World ground;
    ground.cloud_px_s = 0;
    Film roof(ground, seed + 200, &drift);
    while (drift.withholds() && roof.time_s() < 3) EXPECT_EQ(roof.frame(), SceneVerdict::kRest);
    EXPECT_LT(roof.time_s(), 1.5) << seed;
  }
}

TEST(SceneDrift, HoldsBackThroughMinutesOfSkyUntilARoofComes) {
  constexpr int kFrames = 7500;  // five minutes
  SceneDrift drift(kLandmarks);
  World sky;
  sky.clouds = kLandmarks;
  int frames = 0;
  int claimed = 0;
  bool told = false;
  for (std::uint64_t seed = 1; frames < kFrames; ++seed) {
    Film film(sky, seed, &drift);
    SceneVerdict verdict = SceneVerdict::kRest;
    while (verdict == SceneVerdict::kRest && frames < kFrames) {
      verdict = film.frame();
      ++frames;
      claimed += told && !drift.withholds() ? 1 : 0;
    }
    told = true;
    EXPECT_EQ(drift.moving_rate().has_value(), verdict != SceneVerdict::kRest);
    drift.begin_map();
  }
  // Each of many new maps may seem to be at rest by chance, for some frames.
  EXPECT_LT(claimed, kFrames / 50);
  World ground;
  ground.cloud_px_s = 0;
  Film roof(ground, 1000, &drift);
  while (drift.withholds() && roof.time_s() < 3) EXPECT_EQ(roof.frame(), SceneVerdict::kRest);
  EXPECT_LT(roof.time_s(), 1);
}

TEST(SceneDrift, TakesNeitherPlayNorSwayForADrift) {
  World world;
  world.cloud_px_s = 0;
  for (const auto& error :
       {std::function<double(double)>([](double t) { return t < 2 ? 0.0 : 3.0; }),
        std::function<double(double)>([](double t) { return 3 * std::sin(6 * t); })}) {
    world.telemetry_error_px = error;
    SceneDrift drift(kLandmarks);
    Film film(world, 7, &drift);
    for (int i = 0; i < 250; ++i) ASSERT_EQ(film.frame(), SceneVerdict::kRest) << i;
  }
}

TEST(SceneDrift, WithoutTelemetryChangesNothing) {
  SceneDrift drift(kLandmarks);
  drift.begin_frame(0, Vector2<double>::Zero());
  EXPECT_EQ(drift.judge(kPixel), SceneVerdict::kRest);
  EXPECT_FALSE(drift.withholds());
}

TEST(MovingDirections, RemembersWhatMovedWhereItIsNow) {
  MovingDirections moving;
  const Vector3<double> ahead(1, 0, 0);
  EXPECT_FALSE(moving.contains(ahead, 0));
  // As if the camera turned to the left: what is seen goes to the right.
  moving.add(ahead, Vector2<double>(-0.01, 0), 0.02, 0);
  EXPECT_TRUE(moving.contains(ahead, 0));
  EXPECT_TRUE(moving.contains({std::cos(0.1), std::sin(0.1), 0}, 10));
  EXPECT_FALSE(moving.contains(ahead, 10));
  EXPECT_FALSE(moving.contains({std::cos(0.03), 0, std::sin(0.03)}, 0));
  EXPECT_FALSE(moving.contains({std::cos(0.2), std::sin(0.2), 0}, MovingDirections::kRemembered_s));
  moving.clear();
  EXPECT_FALSE(moving.contains(ahead, 0));
}

TEST(MovingDirections, TheNewestReplacesTheOldest) {
  MovingDirections moving;
  const Vector2<double> still = Vector2<double>::Zero();
  moving.add({1, 0, 0}, still, 0.02, 0);
  for (std::size_t i = 0; i < MovingDirections::kCapacity; ++i)
    moving.add({-1, 0, 0}, still, 0.02, 1);
  EXPECT_FALSE(moving.contains({1, 0, 0}, 1));
  EXPECT_TRUE(moving.contains({-1, 0, 0}, 1));
}

}  // namespace
}  // namespace alidade

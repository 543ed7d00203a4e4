// A scene map that is kept up while it is used: what a found picture changes is on disk when it returns, and what the disk does not take
// changes nothing.

#include "edge_app/localization/scene_upkeep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "edge_app/storage/scene_map_file.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

constexpr double kFocalLength = 1500;
constexpr double kNow_utc_s = 1.7e9;

// A picture straight ahead, its landmarks, and a localization that was found from them.
class SceneUpkeepTest : public testing::Test {
 protected:
  SceneUpkeepTest() {
    const Camera<double> camera{kFocalLength, 1, {0}, 1280, 720, 0, 0};
    map_.lens = LensCurve::of(camera);
    map_.reference_row = 360;
    found_.status = LocalizationStatus::kOk;
    found_.pose.R_base_from_camera = r_frd_from_rdf<double>();
    found_.pose.log_f = std::log(kFocalLength);
    found_.pose.camera = camera;
    found_.covariance_in_map = 1e-10 * Matrix4<double>::Identity();
    std::mt19937_64 random(5);
    for (int i = 0; i < 40; ++i) {
      Feature feature;
      feature.scale = 3;
      feature.u = {160.0 + 120 * (i % 8), 120.0 + 100 * static_cast<double>(i / 8)};
      Vector3<double> d_c;
      EXPECT_EQ(unproject(camera, feature.u, &d_c), ProjectionStatus::kOk);
      SceneLandmark landmark;
      landmark.id = map_.next_landmark++;
      landmark.d_b = r_frd_from_rdf<double>() * d_c;
      landmark.covariance = 1e-8 * Matrix2<double>::Identity();
      landmark.scale_rad = feature.scale / kFocalLength;
      landmark.focal_length_px = kFocalLength;
      for (auto& value : landmark.descriptor) value = static_cast<std::uint8_t>(random() % 60);
      landmark.life.born_utc_s = landmark.life.last_seen_utc_s = kNow_utc_s - 1000;
      map_.landmarks.push_back(landmark);
      seen_.features.push_back(feature);
      seen_.descriptors.push_back(landmark.descriptor);
      found_.matched.push_back({i, landmark.id});
    }
    // Of a landmark that is no more: the index is older than the map.
    found_.matched.back().landmark = 1000;
  }

  TemporaryDirectory directory_;
  SceneMap map_;
  FeatureSet seen_;
  Localization found_;
};

TEST_F(SceneUpkeepTest, IsOnDiskWhenItReturns) {
  const std::string path = directory_.path() + "/scene.map";
  std::string error;
  ASSERT_TRUE(save_scene_map(path, map_, &error)) << error;
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error) && file.read(&map_, &error)) << error;
  SceneUpkeep upkeep(
      [&](const MapChange& change, std::string* why) { return file.update(change, why); });
  for (int view = 1; view <= 3; ++view) {
    upkeep.show(found_, seen_, kNow_utc_s + view, &map_);
    EXPECT_EQ(upkeep.report().pictures, view);
    EXPECT_EQ(upkeep.report().updates, view);
    // All 40 are in view, and one was not found.
    EXPECT_EQ(upkeep.report().expected, 40 * view);
    EXPECT_EQ(upkeep.report().updated, 39 * view);
    SceneMap stored;  // as another process reads it, whatever becomes of this one
    ASSERT_TRUE(load_scene_map(path, &stored, &error)) << error;
    ASSERT_EQ(stored.landmarks.size(), map_.landmarks.size());
    EXPECT_EQ(stored.landmarks.front().life.matched, static_cast<std::uint32_t>(view));
    EXPECT_EQ(stored.landmarks.front().life.last_seen_utc_s, kNow_utc_s + view);
    EXPECT_EQ(stored.landmarks.back().life.matched, 0U);
    EXPECT_LT(stored.landmarks.front().covariance.trace(), 2e-8);
  }
}

// What stays where no landmark is, close to those that are, is one after 20 pictures; what is missed for days is none.
TEST_F(SceneUpkeepTest, TellsBirthsAndDeaths) {
  SceneUpkeep upkeep([](const MapChange&, std::string*) { return true; });
  found_.matched.pop_back();
  Feature feature;
  feature.scale = 3;
  feature.u = {640, 360};
  seen_.features.push_back(feature);
  Descriptor descriptor{};
  descriptor.fill(90);
  seen_.descriptors.push_back(descriptor);
  constexpr double kDay_s = 86400;
  for (int view = 0; view < 25; ++view) {
    upkeep.show(found_, seen_, kNow_utc_s + 0.5 * kDay_s * view, &map_);
  }
  EXPECT_EQ(upkeep.report().born, 1);
  EXPECT_EQ(upkeep.report().died, 1);
  EXPECT_EQ(upkeep.report().hidden, 0);
}

TEST_F(SceneUpkeepTest, EndsWhereTheDiskTakesNothing) {
  int asked = 0;
  SceneUpkeep upkeep([&](const MapChange&, std::string* why) {
    *why = "disk full";
    return ++asked == 0;
  });
  EXPECT_TRUE(upkeep.keeps_up());
  upkeep.show(found_, seen_, kNow_utc_s, &map_);
  upkeep.show(found_, seen_, kNow_utc_s + 1, &map_);
  EXPECT_FALSE(upkeep.keeps_up());
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(upkeep.report().updates, 0);
  EXPECT_EQ(upkeep.report().updated, 0);
  EXPECT_TRUE(upkeep.report().stopped);
  EXPECT_EQ(map_.landmarks.front().life.matched, 0U);
}

}  // namespace
}  // namespace alidade

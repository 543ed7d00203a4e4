#include "core/mapping/localization.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/mapping/map_building.h"
#include "test/core/mapping/pictured_scene.h"

namespace alidade::test {
namespace {

constexpr double kFeatureNoise_px = 0.15;

SeenPicture picture_at(double pan, double tilt, double f) {
  SeenPicture picture;
  picture.pan = pan;
  picture.tilt = tilt;
  picture.focal_length = f;
  return picture;
}

PicturedScene scene_of(std::uint64_t seed) { return {seed, 1500, 0.8, 0.5}; }

SceneMap map_of(PicturedScene scene) {
  MapBuildOptions options;
  options.width = 1280;
  options.height = 720;
  options.mechanics = Mechanics<double>();
  MapBuilder builder(options);
  for (const double f : {1500.0, 2200.0}) {
    for (const double tilt : {-0.1, 0.1}) {
      for (const double pan : {-0.3, 0.0, 0.3}) {
        MapView view;
        view.recording = "walk";
        view.frame = builder.size();
        view.log_f = std::log(f);
        view.telemetry = PanTilt<double>{pan, tilt};
        view.angle_sigma = 1e-4;
        builder.add(view, scene.features(picture_at(pan, tilt, f), kFeatureNoise_px));
      }
    }
  }
  MapBuild build = builder.build();
  EXPECT_EQ(build.status, MapBuildStatus::kOk);
  return build.map;
}

double off_px(const Localization& found, const SeenPicture& picture) {
  const Eigen::Matrix3d R = picture.base_from_camera(0);
  return picture.focal_length *
         Eigen::AngleAxisd(Eigen::Matrix3d(R.transpose() * found.pose.R_base_from_camera)).angle();
}

// One map for all tests.
class LocalizerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { map_ = new SceneMap(map_of(scene_of(1))); }
  static void TearDownTestSuite() { delete map_; }
  static SceneMap* map_;
};
SceneMap* LocalizerTest::map_ = nullptr;

TEST_F(LocalizerTest, FindsViewsAtAnyZoomOfTheMap) {
  const Localizer localizer(*map_);
  PicturedScene scene = scene_of(1);
  for (const double f : {1500.0, 1800.0, 2300.0}) {
    for (const double pan : {-0.25, 0.1}) {
      const SeenPicture picture = picture_at(pan, 0.05, f);
      const Localization found = localizer.find(scene.features(picture, kFeatureNoise_px));
      ASSERT_EQ(found.status, LocalizationStatus::kOk) << f << " " << pan;
      EXPECT_LT(off_px(found, picture), 1);
      EXPECT_NEAR(found.pose.camera.focal_length, f, 2e-3 * f);
      EXPECT_FALSE(found.by_hint);
    }
  }
}

TEST_F(LocalizerTest, UsesAHintAndSurvivesAWrongOne) {
  const Localizer localizer(*map_);
  PicturedScene scene = scene_of(1);
  const SeenPicture picture = picture_at(0.1, -0.05, 1700);
  const FeatureSet features = scene.features(picture, kFeatureNoise_px);
  LocalizationHint hint;
  hint.R_sigma = 2e-3;
  hint.focal_length = FocalLengthPrior{std::log(1700.0) + 0.005, 0.01};
  hint.R_base_from_camera = picture_at(0.101, -0.051, 1700).base_from_camera(0);
  const Localization found = localizer.find(features, hint);
  ASSERT_EQ(found.status, LocalizationStatus::kOk);
  EXPECT_TRUE(found.by_hint);
  EXPECT_LT(off_px(found, picture), 1);

  hint.R_base_from_camera = picture_at(-0.3, -0.05, 1700).base_from_camera(0);
  const Localization despite = localizer.find(features, hint);
  ASSERT_EQ(despite.status, LocalizationStatus::kOk);
  EXPECT_FALSE(despite.by_hint);
  EXPECT_LT(off_px(despite, picture), 1);
}

// All that the map holds stands in it twice, as it may for two zooms.
TEST_F(LocalizerTest, AThingIsNoRivalOfItself) {
  SceneMap twice = *map_;
  for (const SceneLandmark& landmark : map_->landmarks) {
    twice.landmarks.push_back(landmark);
    twice.landmarks.back().id = twice.next_landmark++;
  }
  PicturedScene scene = scene_of(1);
  const FeatureSet features = scene.features(picture_at(0.1, -0.05, 1700), kFeatureNoise_px);
  const Localization once = Localizer(*map_).find(features);
  const Localization found = Localizer(twice).find(features);
  ASSERT_EQ(once.status, LocalizationStatus::kOk);
  ASSERT_EQ(found.status, LocalizationStatus::kOk);
  EXPECT_GT(found.matches, 0.9 * once.matches);
}

// What the map does not know at a zoom no picture of that zoom knows.
TEST_F(LocalizerTest, APoseIsNoBetterKnownThanTheMapAtItsZoom) {
  constexpr double kWide = 1e-6, kNarrow = 4e-6;
  SceneMap map = *map_;
  for (SceneKeyframe& k : map.keyframes) {
    k.covariance =
        (map.camera_of(k).focal_length < 1800 ? kWide : kNarrow) * Matrix4<double>::Identity();
  }
  const Localizer localizer(map);
  PicturedScene scene = scene_of(1);
  for (const auto& [f, variance] : {std::pair(1600.0, kWide), std::pair(2100.0, kNarrow)}) {
    const Localization found =
        localizer.find(scene.features(picture_at(0.1, 0.05, f), kFeatureNoise_px));
    ASSERT_EQ(found.status, LocalizationStatus::kOk);
    const Matrix4<double> of_map = found.pose.covariance - found.covariance_in_map;
    // Less than a tenth of log f from the nearest: at most 2e-4 of log f and 0.2 px more.
    for (int i = 0; i < 4; ++i) {
      EXPECT_GE(of_map(i, i), variance * (1 - 1e-9)) << f;
      EXPECT_LE(of_map(i, i), variance + 4e-8) << f;
    }
  }
}

// Of 20 views of other scenes none is believed.
TEST_F(LocalizerTest, RefusesAnotherPlace) {
  const Localizer localizer(*map_);
  for (std::uint64_t seed = 2; seed < 22; ++seed) {
    PicturedScene scene = scene_of(seed);
    const FeatureSet features = scene.features(picture_at(0.1, 0, 1700), kFeatureNoise_px);
    EXPECT_EQ(localizer.find(features).status, LocalizationStatus::kNotInMap);
  }
}

TEST_F(LocalizerTest, RefusesAPictureWithTooLittleToSee) {
  const Localizer localizer(*map_);
  EXPECT_EQ(localizer.find({}).status, LocalizationStatus::kNoUsablePicture);
  PicturedScene scene(3, 40, 0.8, 0.5);
  EXPECT_EQ(localizer.find(scene.features(picture_at(0, 0, 1500), kFeatureNoise_px)).status,
            LocalizationStatus::kNoUsablePicture);
}

// A row of equal windows: all that is seen stands there twice, 0.35 rad apart.
TEST(Localizer, DoesNotBelieveOneOfTwoPlacesThatLookAlike) {
  PicturedScene scene(4, 1500, 0.8, 0.5);
  scene.repeat(0.35);
  const SceneMap map = map_of(scene);
  const Localizer localizer(map);
  int wrong = 0;
  for (const double pan : {-0.3, -0.2, 0.0, 0.1, 0.2}) {
    const SeenPicture picture = picture_at(pan, 0, 2200);
    const Localization found = localizer.find(scene.features(picture, kFeatureNoise_px));
    if (found.status == LocalizationStatus::kOk && off_px(found, picture) > 5) ++wrong;
  }
  EXPECT_EQ(wrong, 0);
}

TEST(Localizer, OfAnEmptyMapFindsNothing) {
  SceneMap map;
  map.lens = LensCurve::of({1500, 1, {0}, 1280, 720});
  PicturedScene scene = scene_of(1);
  EXPECT_EQ(Localizer(map).find(scene.features(picture_at(0, 0, 1500), kFeatureNoise_px)).status,
            LocalizationStatus::kNotInMap);
}

}  // namespace
}  // namespace alidade::test

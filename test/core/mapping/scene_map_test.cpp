#include "core/mapping/scene_map.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "test/core/mapping/random_scene_map.h"

namespace alidade::test {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(SceneMap, OfRandomNumbersIsValid) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    std::string error;
    EXPECT_TRUE(is_valid(random_scene_map(seed, 12, 60), &error)) << error;
  }
  EXPECT_TRUE(is_valid(random_scene_map(1, 0, 0)));
}

TEST(SceneMap, ALensIsTheSameOfItsKnotsAndControlPoints) {
  const LensCurve lens = random_scene_map(1, 0, 0).lens;
  std::vector<double> knots;
  for (int i = 0; i <= lens.segments(); ++i) knots.push_back(lens.knot(i));
  LensCurve again(lens.width(), lens.height(), lens.aspect(), knots);
  ASSERT_EQ(again.control_points(), lens.control_points());
  for (int i = 0; i < lens.control_points(); ++i) again.control_point(i) = lens.control_point(i);
  again.hold() = lens.hold();
  for (double s = 6.9; s < 9.5; s += 0.0137) {
    const Camera<double> a = lens.camera_at(s, 1e-3), b = again.camera_at(s, 1e-3);
    EXPECT_EQ(a.focal_length, b.focal_length);
    EXPECT_EQ(a.distortion.radial, b.distortion.radial);
    EXPECT_EQ(a.centre_u, b.centre_u);
    EXPECT_EQ(a.aspect, b.aspect);
  }
}

TEST(SceneMap, IdsAreFound) {
  const SceneMap map = random_scene_map(1, 12, 60);
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    EXPECT_EQ(landmark_index(map, map.landmarks[i].id), static_cast<std::ptrdiff_t>(i));
  }
  EXPECT_EQ(landmark_index(map, 2), -1);  // left out by random_scene_map()
  EXPECT_EQ(landmark_index(map, 1000), -1);
  EXPECT_EQ(keyframe_index(map, 0), -1);
  EXPECT_EQ(keyframe_index(map, map.keyframes[7].id), 7);
}

struct Slip {
  const char* what;  // of the error
  std::function<void(SceneMap*)> make;
};

TEST(SceneMap, EachNumberOutOfRangeIsNamed) {
  const auto k = [](SceneMap* m) -> SceneKeyframe& { return m->keyframes[3]; };
  const auto l = [](SceneMap* m) -> SceneLandmark& { return m->landmarks[4]; };
  const std::vector<Slip> slips = {
      {"curve", [](SceneMap* m) { m->lens = {}; }},
      {"size",
       [](SceneMap* m) {
         m->lens = LensCurve(0, 720, 1, {7, 8});
       }},
      {"size",
       [](SceneMap* m) {
         m->lens = LensCurve(1280, 20000, 1, {7, 8});
       }},
      {"aspect",
       [](SceneMap* m) {
         m->lens = LensCurve(1280, 720, kNotANumber, {7, 8});
       }},
      {"knots",
       [](SceneMap* m) {
         m->lens = LensCurve(1280, 720, 1, {7, 700});
       }},
      {"knots",
       [](SceneMap* m) {
         m->lens = LensCurve(1280, 720, 1, {8, 7});
       }},
      {"the lens has", [](SceneMap* m) { m->lens.control_point(2)[1] = kNotANumber; }},
      {"the lens has", [](SceneMap* m) { m->lens.control_point(2)[0] = 2; }},
      {"hold", [](SceneMap* m) { m->lens.hold() = kNotANumber; }},
      {"hold", [](SceneMap* m) { m->lens.hold() = -11; }},
      {"line delay", [](SceneMap* m) { m->line_delay = kInfinite; }},
      {"row", [](SceneMap* m) { m->reference_row = kNotANumber; }},
      {"axis", [](SceneMap* m) { m->mechanics->tilt_axis *= 1.1; }},
      {"scale", [](SceneMap* m) { m->mechanics->tilt_scale = 0; }},
      {"keyframes' ids", [](SceneMap* m) { std::swap(m->keyframes[1], m->keyframes[2]); }},
      {"keyframes' ids", [](SceneMap* m) { m->keyframes[2] = m->keyframes[1]; }},
      {"landmarks' ids", [](SceneMap* m) { std::swap(m->landmarks[1], m->landmarks[2]); }},
      {"id out of range", [](SceneMap* m) { m->keyframes[0].id = 0; }},
      {"id out of range", [](SceneMap* m) { m->keyframes[11].id = (std::int64_t{1} << 53) + 1; }},
      {"id out of range", [](SceneMap* m) { m->landmarks[0].id = 0; }},
      {"no id is left", [](SceneMap* m) { m->next_landmark = (std::int64_t{1} << 53) + 2; }},
      {"name", [&](SceneMap* m) { k(m).recording.assign(5000, 'a'); }},
      {"frame", [&](SceneMap* m) { k(m).frame = -1; }},
      {"time", [&](SceneMap* m) { k(m).time_utc_s = 1.7e18; }},
      {"zoom", [&](SceneMap* m) { k(m).zoom = kNotANumber; }},
      {"telemetry", [&](SceneMap* m) { k(m).telemetry->pan = kInfinite; }},
      {"focal length", [&](SceneMap* m) { k(m).position = kNotANumber; }},
      {"focal length", [&](SceneMap* m) { k(m).position = 1500; }},
      {"focal length", [&](SceneMap* m) { k(m).eps = kNotANumber; }},
      {"rotation", [&](SceneMap* m) { k(m).R_base_from_camera.w() += 1e-3; }},
      {"rotation", [&](SceneMap* m) { k(m).R_base_from_camera.x() = kNotANumber; }},
      {"covariance", [&](SceneMap* m) { k(m).covariance(1, 1) = -1e-9; }},
      {"covariance", [&](SceneMap* m) { k(m).covariance(3, 0) += 1e-6; }},
      {"covariance", [&](SceneMap* m) { k(m).covariance -= 1e-8 * Matrix4<double>::Identity(); }},
      {"rate", [&](SceneMap* m) { k(m).angular_velocity[2] = kNotANumber; }},
      {"rate", [&](SceneMap* m) { k(m).zoom_rate = kInfinite; }},
      {"residual", [&](SceneMap* m) { k(m).residual_px = -0.1; }},
      {"picture", [&](SceneMap* m) { k(m).picture.resize(SceneMap::kMostPictureBytes + 1); }},
      {"unit vector", [&](SceneMap* m) { l(m).d_b *= 1 + 1e-6; }},
      {"unit vector", [&](SceneMap* m) { l(m).d_b[0] = kNotANumber; }},
      {"covariance", [&](SceneMap* m) { l(m).covariance(0, 1) = l(m).covariance(1, 0) = 1; }},
      {"covariance", [&](SceneMap* m) { l(m).shared_covariance(0, 0) = kNotANumber; }},
      {"size", [&](SceneMap* m) { l(m).scale_rad = 0; }},
      {"size", [&](SceneMap* m) { l(m).scale_rad = kNotANumber; }},
      {"focal length", [&](SceneMap* m) { l(m).focal_length_px = -1000; }},
      {"time", [&](SceneMap* m) { l(m).life.born_utc_s = kNotANumber; }},
      {"found more", [&](SceneMap* m) { l(m).life.matched = l(m).life.looked_for + 1; }},
      {"out of order", [&](SceneMap* m) { std::swap(l(m).sightings[0], l(m).sightings[1]); }},
      {"not finite", [&](SceneMap* m) { l(m).sightings[1].u[0] = kNotANumber; }},
      {"sighting whose size", [&](SceneMap* m) { l(m).sightings[1].scale_px = 0; }},
      {"which does not exist", [&](SceneMap* m) { l(m).sightings.back().keyframe = 99; }},
      {"already in use", [](SceneMap* m) { m->next_landmark = m->landmarks.back().id; }},
      {"keyframes, at most", [](SceneMap* m) { m->keyframes.resize(100'001); }},
  };
  for (std::size_t i = 0; i < slips.size(); ++i) {
    SceneMap map = random_scene_map(7, 12, 60);
    slips[i].make(&map);
    std::string error;
    EXPECT_FALSE(is_valid(map, &error)) << i << " " << slips[i].what;
    EXPECT_NE(error.find(slips[i].what), std::string::npos)
        << i << " " << slips[i].what << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST(SceneMap, AnErrorNamesTheLandmark) {
  SceneMap map = random_scene_map(7, 12, 60);
  map.landmarks[4].d_b.setZero();
  std::string error;
  EXPECT_FALSE(is_valid(map, &error));
  EXPECT_EQ(error, "landmark " + std::to_string(map.landmarks[4].id) +
                       " has a direction that is not a unit vector");
}

}  // namespace
}  // namespace alidade::test

#include "core/mapping/map_building.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <vector>

#include "test/core/mapping/pictured_scene.h"

namespace alidade::test {
namespace {

constexpr double kNoise_px = 0.15;
constexpr double kAngleSigma = 2e-4;  // rad

MapBuildOptions usual_options() {
  MapBuildOptions options;
  options.width = 1280;
  options.height = 720;
  options.mechanics = Mechanics<double>();
  return options;
}

// Three by two views at each of these focal lengths, half of their field apart.
std::vector<SeenPicture> seen_pictures(const std::vector<double>& focal_lengths, double pan = 0) {
  std::vector<SeenPicture> out;
  for (const double f : focal_lengths) {
    for (int row = 0; row < 2; ++row) {
      for (int column = -1; column <= 1; ++column) {
        SeenPicture picture;
        picture.focal_length = f;
        picture.pan = pan + column * 0.4 * 1280 / f;
        picture.tilt = (row - 0.5) * 0.4 * 720 / f;
        picture.corner_distortion = -0.03;
        picture.centre_offset = {5, -4};
        out.push_back(picture);
      }
    }
  }
  return out;
}

struct Knowledge {
  bool telemetry = true;
  bool focal_length = true;
};

MapBuilder builder_of(const std::vector<SeenPicture>& pictures, PicturedScene scene,
                      const Knowledge& knowledge = {},
                      const MapBuildOptions& options = usual_options()) {
  MapBuilder builder(options);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    MapView view;
    view.recording = "walk";
    view.frame = static_cast<std::int64_t>(i);
    if (knowledge.focal_length) view.log_f = std::log(pictures[i].focal_length) + 0.005;
    if (knowledge.telemetry) {
      view.telemetry = PanTilt<double>{pictures[i].pan + kAngleSigma * normal(random),
                                       pictures[i].tilt + kAngleSigma * normal(random)};
      view.angle_sigma = kAngleSigma;
    }
    builder.add(view, scene.features(pictures[i], kNoise_px));
  }
  return builder;
}

// Largest angle by which two keyframes' relation is off, rad.
double relative_error(const MapBuild& build, const std::vector<SeenPicture>& pictures) {
  double most = 0;
  const auto truth = [&](std::size_t k) {
    return pictures[static_cast<std::size_t>(build.of_keyframe[k])].base_from_camera(0);
  };
  const auto found = [&](std::size_t k) {
    return build.map.keyframes[k].R_base_from_camera.toRotationMatrix();
  };
  for (std::size_t k = 1; k < build.map.keyframes.size(); ++k) {
    const Eigen::Matrix3d off =
        (truth(0).transpose() * truth(k)).transpose() * found(0).transpose() * found(k);
    most = std::max(most, Eigen::AngleAxisd(off).angle());
  }
  return most;
}

TEST(MapBuilding, FindsLensAndOrientationsOfAllZooms) {
  const auto pictures = seen_pictures({1500, 3000});
  const MapBuild build = builder_of(pictures, {1, 1500, 0.8, 0.5}).build();
  ASSERT_EQ(build.status, MapBuildStatus::kOk);
  std::string flaw;
  EXPECT_TRUE(is_valid(build.map, &flaw)) << flaw;
  ASSERT_EQ(build.map.keyframes.size(), pictures.size());
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const SceneKeyframe& keyframe = build.map.keyframes[k];
    const double log_f = std::log(build.map.camera_of(keyframe).focal_length);
    const double sigma = std::sqrt(keyframe.covariance(3, 3));
    EXPECT_LT(std::abs(log_f - std::log(pictures[k].focal_length)), 5 * sigma);
    EXPECT_LT(sigma, 3e-4);
    EXPECT_NEAR(keyframe.residual_px, kNoise_px * std::sqrt(2), 0.06);
  }
  EXPECT_LT(relative_error(build, pictures), 5 * kAngleSigma);
}

// The turn that takes the directions nearest to the others (Kabsch 1976).
Eigen::Matrix3d common_turn(const std::vector<Eigen::Vector3d>& from,
                            const std::vector<Eigen::Vector3d>& to) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) sum += to[i] * from[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> parts(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return parts.matrixU() * parts.matrixV().transpose();
}

// What all have in common is one draw, whatever their number: it is taken off, and the landmarks' own parts are left.
TEST(MapBuilding, SaysHowWellItKnowsALandmark) {
  const auto pictures = seen_pictures({1500});
  const MapBuild build = builder_of(pictures, {2, 1500, 0.8, 0.5}).build();
  ASSERT_EQ(build.status, MapBuildStatus::kOk);
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> seen;
  std::vector<Matrix2<double>> covariances;
  for (const SceneLandmark& l : build.map.landmarks) {
    if (l.sightings.size() < 2) continue;
    const auto k = static_cast<std::size_t>(keyframe_index(build.map, l.sightings[0].keyframe));
    found.push_back(l.d_b);
    seen.push_back(pictures[k].direction_of(l.sightings[0].u));
    const double sigma = kNoise_px / pictures[k].focal_length;
    covariances.emplace_back(l.covariance + sigma * sigma * Matrix2<double>::Identity());
  }
  ASSERT_GT(found.size(), 200U);
  const Eigen::Matrix3d turn = common_turn(seen, found);
  double mean = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vector2<double> off = direction_minus(found[i], Vector3<double>(turn * seen[i]));
    mean += off.dot(covariances[i].inverse() * off) / (2 * static_cast<double>(found.size()));
  }
  // The sighting is one of those, two or more, that the landmark rests on: with its noise s^2 and n of them their difference has
  // s^2 (1 - 1/n) where s^2 (1 + 1/n) is claimed, a third for two.
  EXPECT_GT(mean, 0.25);
  EXPECT_LT(mean, 0.8);
}

TEST(MapBuilding, NeedsNoTelemetry) {
  const auto pictures = seen_pictures({1500, 2600});
  const MapBuild build = builder_of(pictures, {3, 1500, 0.8, 0.5}, {false, true}).build();
  ASSERT_EQ(build.status, MapBuildStatus::kOk);
  ASSERT_EQ(build.map.keyframes.size(), pictures.size());
  EXPECT_LT(relative_error(build, pictures), 2e-3);
}

TEST(MapBuilding, FindsTheOneFocalLengthOfALensThatDidNotZoom) {
  const auto pictures = seen_pictures({1300});
  const MapBuild build = builder_of(pictures, {4, 1500, 0.9, 0.6}, {false, false}).build();
  ASSERT_EQ(build.status, MapBuildStatus::kOk);
  ASSERT_EQ(build.map.keyframes.size(), pictures.size());
  for (const SceneKeyframe& keyframe : build.map.keyframes) {
    EXPECT_NEAR(build.map.camera_of(keyframe).focal_length, 1300, 13);
  }
}

TEST(MapBuilding, RefusesPartsThatDoNotHangTogether) {
  auto pictures = seen_pictures({1500});
  const auto elsewhere = seen_pictures({1500}, 2.5);
  pictures.insert(pictures.end(), elsewhere.begin(), elsewhere.end());
  const PicturedScene scene(5, 6000, 3.1, 0.5);
  const MapBuild build = builder_of(pictures, scene).build();
  EXPECT_EQ(build.status, MapBuildStatus::kNotConnected);
  ASSERT_EQ(build.groups.size(), 2U);
  EXPECT_EQ(build.groups[0].size(), 6U);
  EXPECT_EQ(build.groups[1].size(), 6U);

  MapBuildOptions options = usual_options();
  options.largest_part = true;
  const MapBuild part = builder_of(pictures, scene, {}, options).build();
  EXPECT_EQ(part.status, MapBuildStatus::kOk);
  EXPECT_EQ(part.map.keyframes.size(), 6U);
  EXPECT_EQ(part.not_connected.size(), 6U);
}

TEST(MapBuilding, LeavesOutOneThatHangsOnNothing) {
  auto pictures = seen_pictures({1500});
  pictures.push_back(pictures.front());
  pictures.back().pan = 2.5;
  const MapBuild build = builder_of(pictures, {6, 6000, 3.1, 0.5}).build();
  EXPECT_EQ(build.status, MapBuildStatus::kOk);
  EXPECT_EQ(build.map.keyframes.size(), 6U);
  EXPECT_EQ(build.not_connected, std::vector<int>{6});
}

TEST(MapBuilding, NamesPicturesWithoutTexture) {
  auto pictures = seen_pictures({1500});
  MapBuilder builder = builder_of(pictures, {7, 1500, 0.8, 0.5});
  MapView view = builder.view(0);
  view.frame = 6;
  builder.add(view, {});
  const MapBuild build = builder.build();
  EXPECT_EQ(build.status, MapBuildStatus::kOk);
  EXPECT_EQ(build.without_texture, std::vector<int>{6});

  MapBuilder nothing(usual_options());
  for (int i = 0; i < 3; ++i) nothing.add(view, {});
  EXPECT_EQ(nothing.build().status, MapBuildStatus::kNoTexture);
}

TEST(MapBuilding, IsTheSameEachTime) {
  const auto pictures = seen_pictures({1500});
  const MapBuild a = builder_of(pictures, {8, 1200, 0.8, 0.5}).build();
  const MapBuild b = builder_of(pictures, {8, 1200, 0.8, 0.5}).build();
  ASSERT_EQ(a.status, MapBuildStatus::kOk);
  ASSERT_EQ(a.map.landmarks.size(), b.map.landmarks.size());
  for (std::size_t i = 0; i < a.map.landmarks.size(); ++i) {
    ASSERT_EQ(a.map.landmarks[i].d_b, b.map.landmarks[i].d_b);
  }
}

TEST(MapBuilding, RefusesOptionsOutOfRange) {
  MapBuildOptions options = usual_options();
  EXPECT_TRUE(options.validate());
  options.width = 0;
  const char* error = nullptr;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_NE(error, nullptr);
  EXPECT_EQ(MapBuilder(options).build().status, MapBuildStatus::kBadInput);
}

}  // namespace
}  // namespace alidade::test

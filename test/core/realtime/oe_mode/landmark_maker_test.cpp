// New landmarks: where there are none, as many as allowed, and at the directions that show them.

#include "core/realtime/oe_mode/landmark_maker.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "test/core/realtime/oe_mode/textured_scene.h"

namespace alidade::test {
namespace {

class MadeLandmarks : public testing::Test {
 protected:
  TexturedScene scene_;
  LandmarkMaker maker_{TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                       TexturedScene::kHeight};
};

TEST_F(MadeLandmarks, CoverAnEmptyViewInEachOctaveAtOnce) {
  scene_.look({0, 0});
  EXPECT_EQ(scene_.make_landmarks(&maker_, {0, 0}), 1) << "all in view are new";
  std::set<int> octaves;
  std::set<std::pair<int, int>> cells;
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    const Landmark& landmark = scene_.map_.at(slot);
    octaves.insert(landmark.octave);
    Vector2<double> u;
    const ViewProjection view(scene_.calibration_, TexturedScene::motion_at({0, 0}));
    ASSERT_TRUE(view.project(landmark.d, &u));
    if (landmark.octave == 0) {
      const bool fresh =
          cells.insert({static_cast<int>(u.x() / 24), static_cast<int>(u.y() / 24)}).second;
      EXPECT_TRUE(fresh) << "one a cell";
    }
    EXPECT_GT(landmark.covariance.trace(), 0);
  }
  EXPECT_GE(octaves.size(), 3U);
  EXPECT_GT(cells.size(), 40U) << "of 130";
}

TEST_F(MadeLandmarks, AreFewerTheMoreThereAre) {
  scene_.look({0, 0});
  double share = 1;
  for (int i = 0; i < 10; ++i) {
    share = scene_.make_landmarks(&maker_, {0, 0});
    EXPECT_LE(share, i == 0 ? 1 : 0.5);
  }
  EXPECT_LT(share, 0.05);
}

TEST_F(MadeLandmarks, AreNoMoreThanAllowedWhereTheViewIsNotEmpty) {
  LandmarkMakerOptions options = TexturedScene::maker_options();
  options.empty_view = 0;
  options.max_new = 7;
  LandmarkMaker maker(options, OctaveOptions{}, TexturedScene::kWidth, TexturedScene::kHeight);
  scene_.look({0, 0});
  int before = 0;
  for (int i = 0; i < 5; ++i) {
    static_cast<void>(scene_.make_landmarks(&maker, {0, 0}));
    EXPECT_GT(scene_.map_.size(), before);
    EXPECT_LE(scene_.map_.size(), before + 7);
    before = scene_.map_.size();
  }
}

TEST_F(MadeLandmarks, NeedATexture) {
  scene_.look({0, 0});
  EXPECT_TRUE(maker_.is_textured(scene_.pyramid_, scene_.octaves_));
  scene_.look_at_nothing();
  EXPECT_FALSE(maker_.is_textured(scene_.pyramid_, scene_.octaves_));
  EXPECT_EQ(scene_.make_landmarks(&maker_, {0, 0}), 0);
  EXPECT_EQ(scene_.map_.size(), 0);
}

}  // namespace
}  // namespace alidade::test

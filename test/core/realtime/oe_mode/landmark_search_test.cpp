// Finding landmarks from a prediction that is off, and what it makes of views that show none.

#include "core/realtime/oe_mode/landmark_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "test/core/realtime/oe_mode/textured_scene.h"

namespace alidade::test {
namespace {

class SearchedScene : public testing::Test {
 protected:
  SearchedScene() {
    search_.reset(scene_.calibration_);
    LandmarkMaker maker(TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                        TexturedScene::kHeight);
    scene_.look({0, 0});
    static_cast<void>(scene_.make_landmarks(&maker, {0, 0}));
  }

  [[nodiscard]] SearchedFrame frame() const {
    return {scene_.calibration_, scene_.map_, scene_.pyramid_, scene_.octaves_};
  }

  TexturedScene scene_;
  LandmarkSearch search_{LandmarkSearchOptions{}, scene_.map_.capacity()};
};

TEST_F(SearchedScene, MovesAPredictionToWhereCoarseLandmarksFit) {
  const Vector2<double> at(5.3, -3.7);
  scene_.look(at);
  for (const Vector2<double>& off : {Vector2<double>(0, 0), {4, 3}, {-9, 14}}) {
    const LandmarkSearch::Coarse coarse =
        search_.align_coarse(frame(), TexturedScene::motion_at(at + off), off.norm());
    ASSERT_TRUE(coarse.aligned) << off.transpose();
    const Vector2<double> left =
        coarse.motion.angle.vector() - TexturedScene::motion_at(at).angle.vector();
    EXPECT_LT(left.norm(), 0.3 * TexturedScene::kPixel) << off.transpose();
    EXPECT_NEAR(coarse.shift_px, off.norm(), 0.3);
  }
}

TEST_F(SearchedScene, FindsFineLandmarksWhereTheyAre) {
  const Vector2<double> at(5.3, -3.7);
  scene_.look(at);
  const LandmarkSearch::Fine fine =
      search_.align_fine(frame(), TexturedScene::motion_at(at + Vector2<double>(0.5, 0.2)));
  EXPECT_GT(fine.chosen, 50);
  EXPECT_GE(fine.visible, fine.chosen);
  EXPECT_GT(fine.found, 0.9 * fine.chosen);
  ASSERT_EQ(search_.found().size(), static_cast<std::size_t>(fine.found));
  ASSERT_EQ(search_.observations().size(), search_.found().size());
  ASSERT_EQ(search_.J_tangent().size(), search_.found().size());
  // Residuals less what the prediction was off by are as large as said.
  Vector6 correction = Vector6::Zero();
  correction.head<2>() = -TexturedScene::kPixel * Vector2<double>(0.5, 0.2);
  for (FoundLandmark& found : search_.found()) found.inlier = true;
  search_.conclude(correction);
  double squares = 0;
  for (std::size_t i = 0; i < search_.found().size(); ++i) {
    const OeObservation& found = search_.observations()[i];
    EXPECT_EQ(found.id, scene_.map_.at(found.slot).id);
    EXPECT_TRUE(found.inlier);
    squares += found.residual.dot(search_.found()[i].covariance.inverse() * found.residual) / 2;
  }
  EXPECT_LT(squares / fine.found, 2);
  EXPECT_GT(squares / fine.found, 0.3);
}

TEST_F(SearchedScene, FindsNothingWhereThereIsNothing) {
  scene_.look_at_nothing();
  const LandmarkSearch::Coarse coarse =
      search_.align_coarse(frame(), TexturedScene::motion_at({0, 0}), 1);
  EXPECT_FALSE(coarse.aligned);
  EXPECT_EQ(coarse.shift_px, 0);
  EXPECT_EQ(coarse.motion.angle.pan, 0) << "as predicted";
  const LandmarkSearch::Fine fine = search_.align_fine(frame(), coarse.motion);
  EXPECT_GT(fine.chosen, 50);
  EXPECT_EQ(fine.found, 0);
}

// Every other landmark has served well: of each part of the image such a one is looked for, and found.
TEST_F(SearchedScene, LooksForNoMoreThanItMayAndForTheReliableOfAllTheImage) {
  LandmarkSearchOptions options;
  options.choice.max_chosen = 6;
  options.choice.columns = 3;
  options.choice.rows = 2;
  LandmarkSearch search(options, scene_.map_.capacity());
  search.reset(scene_.calibration_);
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    scene_.map_.statistics(slot).looked_for = 100;
    scene_.map_.statistics(slot).matched = slot % 2 == 1 ? 100 : 10;
  }
  const LandmarkSearch::Fine fine = search.align_fine(frame(), TexturedScene::motion_at({0, 0}));
  EXPECT_EQ(fine.chosen, 6);
  EXPECT_EQ(fine.found, 6);
  EXPECT_GT(fine.visible, 10 * 6);
  ASSERT_EQ(search.chosen().size(), 6U);
  std::set<std::pair<int, int>> parts;
  for (const VisibleLandmark& chosen : search.chosen()) {
    EXPECT_EQ(chosen.slot % 2, 1);
    parts.insert({static_cast<int>(chosen.u.x() * 3 / TexturedScene::kWidth),
                  static_cast<int>(chosen.u.y() * 2 / TexturedScene::kHeight)});
  }
  EXPECT_EQ(parts.size(), 6U);
  search.clear();
  EXPECT_TRUE(search.chosen().empty());
  EXPECT_TRUE(search.found().empty());
  EXPECT_TRUE(search.coarse().empty());
}

}  // namespace
}  // namespace alidade::test

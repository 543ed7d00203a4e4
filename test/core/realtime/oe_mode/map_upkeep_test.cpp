// What frames make of the landmarks: better known, missed, given up; and of the whole map.

#include "core/realtime/oe_mode/map_upkeep.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "test/core/realtime/oe_mode/textured_scene.h"

namespace alidade::test {
namespace {

class KeptMap : public testing::Test {
 protected:
  KeptMap() {
    search_.reset(scene_.calibration_);
    LandmarkMaker maker(TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                        TexturedScene::kHeight);
    scene_.look({0, 0});
    static_cast<void>(scene_.make_landmarks(&maker, {0, 0}));
  }

  // A frame whose motion is known exactly; all that is found agrees.
  void see(const Vector2<double>& at) {
    frame_.frame = ++frames_;
    frame_.motion = TexturedScene::motion_at(at);
    const SearchedFrame searched{scene_.calibration_, scene_.map_, scene_.pyramid_,
                                 scene_.octaves_};
    static_cast<void>(search_.align_coarse(searched, frame_.motion, 0.1));
    static_cast<void>(search_.align_fine(searched, frame_.motion));
    for (FoundLandmark& found : search_.found()) found.inlier = true;
    search_.conclude(Vector6::Zero());
  }

  void keep() {
    upkeep_.refine(frame_, search_, &scene_.map_);
    upkeep_.judge_coarse(scene_.calibration_, scene_.pyramid_, frame_, search_, &scene_.map_);
  }

  void expect_little_is_learnt() {
    std::map<int, Landmark> before;
    for (const OeObservation& seen : search_.observations()) {
      before[seen.slot] = scene_.map_.at(seen.slot);
    }
    ASSERT_GT(before.size(), 50U);
    keep();
    for (const auto& [slot, landmark] : before) {
      EXPECT_GT(scene_.map_.at(slot).covariance.trace(), 0.99 * landmark.covariance.trace());
      EXPECT_LT((scene_.map_.at(slot).d - landmark.d).norm(), 1e-3 * TexturedScene::kPixel);
    }
  }

  TexturedScene scene_;
  LandmarkSearch search_{LandmarkSearchOptions{}, scene_.map_.capacity()};
  MapUpkeep upkeep_{MapUpkeepOptions{}};
  ProcessedFrame frame_;
  std::uint32_t frames_ = 100;
};

TEST_F(KeptMap, KnowsLandmarksBetterTheOftenerTheyAreFound) {
  std::set<int> slots;
  double before = 0;
  see({0, 0});
  for (const OeObservation& seen : search_.observations()) {
    slots.insert(seen.slot);
    before += scene_.map_.at(seen.slot).covariance.trace();
  }
  for (int i = 0; i < 10; ++i) {
    const Vector2<double> at(0.3 * i, -0.2 * i);
    scene_.look(at);
    see(at);
    keep();
  }
  double after = 0;
  int matched = 0;
  for (const int slot : slots) {
    if (!scene_.map_.occupied(slot)) continue;
    after += scene_.map_.at(slot).covariance.trace();
    matched += static_cast<int>(scene_.map_.at(slot).statistics.matched);
  }
  EXPECT_LT(after, 0.3 * before);
  EXPECT_GT(matched, 9 * static_cast<int>(slots.size()));
}

TEST_F(KeptMap, GivesUpWhatIsMissedTooOften) {
  const int size = scene_.map_.size();
  scene_.look_at_nothing();
  const int allowed = MapUpkeepOptions{}.max_misses;
  for (int i = 1; i < allowed; ++i) {
    see({0, 0});
    keep();
  }
  EXPECT_EQ(scene_.map_.size(), size);
  see({0, 0});
  keep();
  EXPECT_LT(scene_.map_.size(), 0.2 * size) << "what was in view is gone";
}

TEST_F(KeptMap, IsOfNoUseAfterTooManyContradictionsInARow) {
  const MapUpkeepOptions options;
  for (int i = 0; i < options.contradictions_to_forget; ++i) upkeep_.note_lost(true, false);
  EXPECT_FALSE(upkeep_.is_useless());
  upkeep_.note_lost(false, false);
  for (int i = 0; i < options.contradictions_to_forget; ++i) upkeep_.note_lost(true, false);
  EXPECT_FALSE(upkeep_.is_useless()) << "not in a row";
  upkeep_.note_lost(true, false);
  EXPECT_TRUE(upkeep_.is_useless());
  upkeep_.note_held();
  EXPECT_FALSE(upkeep_.is_useless());
  for (int i = 0; i <= options.lost_to_forget; ++i) upkeep_.note_lost(false, false);
  EXPECT_TRUE(upkeep_.is_useless());
  EXPECT_FALSE(upkeep_.is_doubtful());
}

TEST_F(KeptMap, IsDoubtfulWhereLandmarksLackThatShouldBeInView) {
  for (int i = 0; i < MapUpkeepOptions{}.missed_to_doubt; ++i) upkeep_.note_lost(false, true);
  EXPECT_FALSE(upkeep_.is_doubtful());
  upkeep_.note_lost(false, true);
  EXPECT_TRUE(upkeep_.is_doubtful());
  upkeep_.reset();
  EXPECT_FALSE(upkeep_.is_doubtful());
}

TEST_F(KeptMap, LosesOnlyWhatNoFrameOfItsOwnHasProven) {
  std::vector<VisibleLandmark> visible;
  for (int slot = 0; slot < 6; ++slot) {
    scene_.map_.statistics(slot).last_frame = slot % 2 == 0 ? 0 : 7;
    if (slot < 4) visible.push_back({slot, 0, {1, 1}});
  }
  EXPECT_TRUE(upkeep_.has_unproven(visible, scene_.map_));
  EXPECT_EQ(upkeep_.retire_unproven(visible, &scene_.map_), 2);
  for (int slot = 0; slot < 6; ++slot) {
    EXPECT_EQ(scene_.map_.occupied(slot), slot % 2 == 1 || slot == 4) << slot;
  }
  EXPECT_FALSE(upkeep_.has_unproven({{1, 0, {1, 1}}}, scene_.map_));
}

// What a frame says is no better than its own orientation ...
TEST_F(KeptMap, LearnsLittleFromAFrameThatHardlyKnowsWhereItLooks) {
  see({0, 0});
  frame_.covariance.topLeftCorner<2, 2>().setIdentity();  // rad^2
  expect_little_is_learnt();
}

// ... and than its landmarks agree with each other.
TEST_F(KeptMap, LearnsLittleFromAFrameWhoseLandmarksContradictEachOther) {
  see({0, 0});
  frame_.inflation = 1e6;
  expect_little_is_learnt();
}

// Of a landmark that nobody knew, all is as the frame shows it: where the frame's angles follow the calibration, its
// direction does, so that it stays where it was found.
TEST_F(KeptMap, FollowsTheCalibrationAsTheFrameDoes) {
  constexpr int kParameter = index(Parameter::kClockOffset);  // moves nothing but angles
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    scene_.map_.refine(slot, scene_.map_.at(slot).d, Matrix2<double>::Identity());
    scene_.map_.sensitivity(slot).setZero();
  }
  see({0, 0});
  const Vector2<double> rate = TexturedScene::kPixel * Vector2<double>(30, -20);
  frame_.sensitivity.setZero();
  frame_.sensitivity.col(kParameter).head<2>() = rate;
  ASSERT_GT(search_.found().size(), 50U);
  keep();
  for (std::size_t i = 0; i < search_.found().size(); ++i) {
    const int slot = search_.observations()[i].slot;
    const Vector2<double> by_angle = search_.found()[i].J_angle * rate;
    const Vector2<double> by_direction =
        search_.J_tangent()[i] * scene_.map_.at(slot).sensitivity.col(kParameter).cast<double>();
    EXPECT_GT(by_angle.norm(), 30);
    EXPECT_LT((by_angle + by_direction).norm(), 1e-3 * by_angle.norm());
  }
}

TEST_F(KeptMap, GivesUpCoarseLandmarksThatLookLikeSomethingElse) {
  see({0, 0});
  const std::vector<int> coarse = search_.coarse_slots();
  ASSERT_GT(coarse.size(), 5U);
  scene_.look({3000, 2000});
  for (int i = 0; i < MapUpkeepOptions{}.max_misses; ++i) {
    see({0, 0});
    keep();
  }
  const auto left = std::count_if(coarse.begin(), coarse.end(),
                                  [&](int slot) { return scene_.map_.occupied(slot); });
  EXPECT_LT(left, static_cast<std::ptrdiff_t>(coarse.size()) / 2);
}

}  // namespace
}  // namespace alidade::test

// What frames make of the landmarks: better known, missed, given up; and of the whole map.

#include "core/realtime/oe_mode/map_upkeep.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <set>

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

}  // namespace
}  // namespace alidade::test

// Which landmarks are aligned: all where there is room, else the most reliable of each part of the image.

#include "core/realtime/oe_mode/landmark_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace alidade::test {
namespace {

// Visible landmarks in an image of 1000 x 600 px, and a map that knows how they served.
class ChosenLandmarks : public testing::Test {
 protected:
  static constexpr int kWidth = 1000;
  static constexpr int kHeight = 600;

  // seen: how often it was looked for; matched: found. Returns its slot.
  int add(const Vector2<double>& u, int octave, int seen = 0, int matched = 0) {
    Landmark landmark;
    const double azimuth = 0.01 * static_cast<double>(visible_.size());
    landmark.d = {std::cos(azimuth), std::sin(azimuth), 0};
    landmark.octave = static_cast<std::uint8_t>(octave);
    int slot = -1;
    EXPECT_EQ(map_.insert(landmark, 1, &slot), InsertStatus::kOk);
    map_.statistics(slot).seen = static_cast<std::uint32_t>(seen);
    map_.statistics(slot).matched = static_cast<std::uint32_t>(matched);
    visible_.push_back({slot, octave, u});
    return slot;
  }

  std::vector<int> choose(const LandmarkChoiceOptions& options) {
    LandmarkChoice choice(options, map_.capacity());
    std::vector<int> slots;
    for (const VisibleLandmark& v : choice.choose(visible_, map_, octaves_, camera_)) {
      slots.push_back(v.slot);
    }
    candidates_ = choice.candidates();
    return slots;
  }

  static LandmarkChoiceOptions at_most(int used) {
    LandmarkChoiceOptions options;
    options.max_used = used;
    return options;
  }

  Camera<double> camera_{1000, 1, 0, kWidth, kHeight};
  LandmarkMap map_{500, 1e-3};
  Octaves octaves_{OctaveOptions{}};
  std::vector<VisibleLandmark> visible_;
  int candidates_ = 0;
};

TEST_F(ChosenLandmarks, AreAllFineOnesInTheirOrderWhereThereIsRoom) {
  std::vector<int> fine;
  for (int i = 0; i < 30; ++i) {
    const int octave = i % 4;
    const int slot = add({500, 300}, octave, 10, i % 10);
    if (octave < 2) fine.push_back(slot);
  }
  EXPECT_THAT(choose(at_most(static_cast<int>(fine.size()))), testing::ElementsAreArray(fine));
  EXPECT_EQ(candidates_, static_cast<int>(fine.size()));
  EXPECT_EQ(visible_.size(), 30U) << "what is visible stays as it is";
  for (const VisibleLandmark& v : visible_) EXPECT_GE(v.slot, 0);
}

TEST_F(ChosenLandmarks, AreTheMostReliableOfEachPartFirstWhereThereIsNoRoomForAll) {
  LandmarkChoiceOptions options = at_most(6);
  options.columns = 3;
  options.rows = 2;
  std::set<int> best;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      const Vector2<double> middle((column + 0.5) * kWidth / 3, (row + 0.5) * kHeight / 2);
      add(middle, 0, 20, 5);
      best.insert(add(middle + Vector2<double>(9, 0), 0, 20, 19));
      add(middle + Vector2<double>(0, 9), 1, 20, 20);  // sees half as sharply
      add(middle, 2, 20, 20);                          // coarse
    }
  }
  const std::vector<int> chosen = choose(options);
  EXPECT_EQ(std::set<int>(chosen.begin(), chosen.end()), best);
  EXPECT_EQ(candidates_, 18);
}

TEST_F(ChosenLandmarks, FillTheRoomThatIsLeftWithTheOthersAndTakeNoneTwice) {
  LandmarkChoiceOptions options = at_most(4);
  options.columns = 2;
  options.rows = 1;
  for (int i = 0; i < 10; ++i) add({100.0, 300.0}, 0, 20, i);
  EXPECT_THAT(choose(options), testing::ElementsAre(visible_[9].slot, visible_[0].slot,
                                                    visible_[1].slot, visible_[2].slot));
}

TEST_F(ChosenLandmarks, OfASmallNumberAreSpreadOverTheImage) {
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 20; ++column) {
      add({(column + 0.5) * kWidth / 20, (row + 0.5) * kHeight / 12}, 0);
    }
  }
  const std::vector<int> chosen = choose(at_most(24));
  std::set<int> quarters;
  for (const int slot : chosen) {
    const auto seen = std::find_if(visible_.begin(), visible_.end(),
                                   [&](const VisibleLandmark& v) { return v.slot == slot; });
    quarters.insert((seen->u.x() > kWidth / 2.0 ? 1 : 0) + (seen->u.y() > kHeight / 2.0 ? 2 : 0));
  }
  EXPECT_EQ(chosen.size(), 24U);
  EXPECT_EQ(quarters.size(), 4U);
}

TEST_F(ChosenLandmarks, AreAllButOneWhereThereIsRoomForAllButOneInAnyNumberOfParts) {
  for (int i = 0; i < 300; ++i) {
    add({std::fmod(i * 61.8, kWidth), std::fmod(i * 38.2, kHeight)}, 0, 10, i % 11);
  }
  for (const int columns : {1, 7, 20, 96}) {
    for (const int rows : {1, 12, 96}) {
      LandmarkChoiceOptions options = at_most(299);
      options.columns = columns;
      options.rows = rows;
      const std::vector<int> chosen = choose(options);
      EXPECT_EQ(std::set<int>(chosen.begin(), chosen.end()).size(), 299U);
    }
  }
}

}  // namespace
}  // namespace alidade::test

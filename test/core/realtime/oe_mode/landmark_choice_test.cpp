// Which landmarks are chosen: all where there is room, else the most reliable of each part of the image.

#include "core/realtime/oe_mode/landmark_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace alidade::test {
namespace {

// Visible landmarks in an image of 1000 x 600 px, and a map that knows how they served.
class ChosenLandmarks : public testing::Test {
 protected:
  static constexpr int kWidth = 1000;
  static constexpr int kHeight = 600;

  // looked_for, matched: how often. Returns its slot.
  int add(const Vector2<double>& u, int octave, int looked_for = 0, int matched = 0) {
    Landmark landmark;
    const double azimuth = 0.004 * static_cast<double>(visible_.size());
    landmark.d = {std::cos(azimuth), std::sin(azimuth), 0};
    landmark.octave = static_cast<std::uint8_t>(octave);
    int slot = -1;
    EXPECT_EQ(map_.insert(landmark, 1, &slot), InsertStatus::kOk);
    map_.statistics(slot).looked_for = static_cast<std::uint32_t>(looked_for);
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
    fine_visible_ = choice.fine_visible();
    return slots;
  }

  static LandmarkChoiceOptions at_most(int chosen) {
    LandmarkChoiceOptions options;
    options.max_chosen = chosen;
    return options;
  }

  Camera<double> camera_{1000, 1, {0}, kWidth, kHeight};
  LandmarkMap map_{2000, 4e-4};
  Octaves octaves_{OctaveOptions{}};
  std::vector<VisibleLandmark> visible_;
  int fine_visible_ = 0;
};

TEST_F(ChosenLandmarks, AreAllFineOnesInTheirOrderWhereThereIsRoom) {
  std::vector<int> fine;
  for (int i = 0; i < 30; ++i) {
    const int octave = i % 4;
    const int slot = add({500, 300}, octave, 10, i % 10);
    if (octave < 2) fine.push_back(slot);
  }
  EXPECT_THAT(choose(at_most(static_cast<int>(fine.size()))), testing::ElementsAreArray(fine));
  EXPECT_EQ(fine_visible_, static_cast<int>(fine.size()));
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
  EXPECT_EQ(fine_visible_, 18);
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

// As they are by default, in an image full of landmarks: no more than there is room for, no part of the image twice,
// all of the image alike, and of each part the one that served best.
TEST_F(ChosenLandmarks, OfAFullImageAreAsManyAsMayBeOneOfAPartTheMostReliableThere) {
  const LandmarkChoiceOptions options;
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto part_of = [&](const Vector2<double>& u) {
    return std::pair(static_cast<int>(u.x() * options.columns / kWidth),
                     static_cast<int>(u.y() * options.rows / kHeight));
  };
  constexpr int kLookedFor = 20;
  std::map<std::pair<int, int>, double> best;  // of each part
  std::map<int, std::pair<Vector2<double>, double>> all;
  for (int i = 0; i < 1500; ++i) {
    const Vector2<double> u(kWidth * uniform(random), kHeight * uniform(random));
    const int octave = static_cast<int>(3 * uniform(random));
    const int matched = static_cast<int>((kLookedFor + 1) * uniform(random));
    const int slot = add(u, octave, kLookedFor, matched);
    if (octave == 2) continue;
    const double reliability = (matched + 1.0) / (octave == 0 ? 1 : 2);
    all[slot] = {u, reliability};
    best[part_of(u)] = std::max(best[part_of(u)], reliability);
  }
  const std::vector<int> chosen = choose(options);
  ASSERT_EQ(chosen.size(), static_cast<std::size_t>(options.max_chosen));
  EXPECT_EQ(fine_visible_, static_cast<int>(all.size()));
  ASSERT_GT(best.size(), chosen.size()) << "parts that have a landmark";
  std::set<std::pair<int, int>> parts;
  std::map<std::pair<int, int>, int> in_twentieths;  // of the image, 5 columns and 4 rows
  for (const int slot : chosen) {
    ASSERT_EQ(all.count(slot), 1U);
    const auto& [u, reliability] = all[slot];
    EXPECT_TRUE(parts.insert(part_of(u)).second) << "no part twice";
    EXPECT_EQ(reliability, best[part_of(u)]) << "the most reliable of its part";
    ++in_twentieths[{static_cast<int>(u.x() * 5 / kWidth), static_cast<int>(u.y() * 4 / kHeight)}];
  }
  ASSERT_EQ(in_twentieths.size(), 20U);
  for (const auto& [place, count] : in_twentieths) {
    EXPECT_GE(count, 7) << "of 12 parts, at column " << place.first << ", row " << place.second;
  }
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

// Which tracks an adjustment is given: evenly over the recording, whatever the camera did in it.

#include "edge_app/self_calibration/track_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace alidade {
namespace {

// |sightings| of each landmark, the first of which moves farthest.
std::vector<CalibrationObservation> tracks_of(const std::vector<int>& sightings) {
  std::vector<CalibrationObservation> all;
  for (std::size_t l = 0; l < sightings.size(); ++l) {
    for (int f = 0; f < sightings[l]; ++f) {
      const auto name = static_cast<std::int64_t>(l);
      all.push_back({f, name, f * (10.0 - static_cast<double>(l)),
                     2 * kSharedPixels_px * static_cast<double>(l), 0.3});
    }
  }
  return all;
}

TEST(TrackChoice, ATrackOfJustEnoughSightingsIsUsed) {
  EXPECT_EQ(choose_tracks(tracks_of({kMinSightings - 1, kMinSightings}), 100).size(),
            static_cast<std::size_t>(kMinSightings));
}

TEST(TrackChoice, AsManyObservationsAsAllowedAreUsed) {
  EXPECT_EQ(choose_tracks(tracks_of({10, 10, 10}), 20).size(), 20U);
  EXPECT_EQ(choose_tracks(tracks_of({10, 10, 10}), 19).size(), 10U);
}

// Landmark 2 is known best; 1 comes as close to it as shared pixels and leaves again; 3 is in another frame.
TEST(TrackChoice, PixelsThatTwoLandmarksShareAreSeenOnce) {
  const double near = kSharedPixels_px - 0.1;
  const double far = kSharedPixels_px + 0.1;
  std::vector<CalibrationObservation> all = {{1, 1, 100 + near, 50, 0.1}, {1, 2, 100, 50, 0.04},
                                             {2, 1, 100, 50 - far, 0.1},  {2, 2, 100, 50, 0.2},
                                             {3, 1, 90, 40, 0.1},         {3, 2, 93, 36, 0.2},
                                             {4, 3, 93, 36, 0.2}};
  std::vector<std::pair<std::int64_t, std::int64_t>> left;
  for (const auto& seen : without_shared_pixels(all)) left.emplace_back(seen.frame, seen.landmark);
  const std::vector<std::pair<std::int64_t, std::int64_t>> expected = {
      {1, 2}, {2, 2}, {2, 1}, {3, 2}, {4, 3}};
  EXPECT_EQ(left, expected);
  for (CalibrationObservation& seen : all) seen.frame = 7 - seen.frame;
  EXPECT_EQ(without_shared_pixels(all).size(), expected.size()) << "in any order";
}

// A recording in which points live for `life` frames and `in_a_frame` are seen at once; each moves by speed(frame) a frame.
template <class Speed>
std::vector<CalibrationObservation> filmed(int frames, int in_a_frame, int life, Speed speed) {
  std::vector<CalibrationObservation> all;
  for (int begin = 0, name = 0; begin < frames; begin += life) {
    for (int i = 0; i < in_a_frame; ++i, ++name) {
      double u = 0;
      for (int f = begin; f < std::min(frames, begin + life); ++f) {
        all.push_back({f, name, u, 3.0 * kSharedPixels_px * i, 0.1});
        u += speed(f) * (1 + 1e-3 * i);
      }
    }
  }
  return all;
}

std::map<std::int64_t, int> in_frames(const std::vector<CalibrationObservation>& observations) {
  std::map<std::int64_t, int> count;
  for (const CalibrationObservation& seen : observations) ++count[seen.frame];
  return count;
}

// 22 s: in the first 9 s the camera turns five times as fast.
TEST(TrackChoice, TheLimitThinsAndCutsNoPartOfARecording) {
  constexpr int kFrames = 660;
  const auto all = filmed(kFrames, 100, 60, [](int f) { return f < 270 ? 10.0 : 2.0; });
  UntrackedFrames untracked;
  const auto chosen = choose_tracks(all, 20000, &untracked);
  EXPECT_LE(chosen.size(), 20000U);
  EXPECT_GT(chosen.size(), 19000U) << "and wastes nothing";
  EXPECT_TRUE(untracked.empty());
  const auto count = in_frames(chosen);
  ASSERT_EQ(count.size(), static_cast<std::size_t>(kFrames));
  for (const auto& [frame, points] : count) {
    EXPECT_GE(points, 25) << frame;
    EXPECT_LE(points, 35) << frame;
  }
  // The farthest first, with all of its sightings.
  std::map<std::int64_t, int> sightings;
  for (const CalibrationObservation& seen : chosen) ++sightings[seen.landmark];
  EXPECT_EQ(sightings.count(99), 1U);
  EXPECT_EQ(sightings.count(0), 0U);
  for (const auto& [name, times] : sightings) EXPECT_EQ(times, 60) << name;
}

// What the camera comes back to is followed through all of it, and worth more than the rest.
TEST(TrackChoice, KeepsWhatIsSeenThroughoutBesideWhatIsSeenOnce) {
  auto all = filmed(600, 80, 20, [](int) { return 3.0; });
  for (int i = 0; i < 10; ++i) {
    for (int f = 0; f < 600; ++f)
      all.push_back({f, 100000 + i, 5.0 * (f % 200), 3000 + 30.0 * i, 0.1});
  }
  const auto chosen = choose_tracks(all, 20000);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(std::count_if(chosen.begin(), chosen.end(),
                            [i](const auto& seen) { return seen.landmark == 100000 + i; }),
              600)
        << i;
  }
  const auto count = in_frames(chosen);
  ASSERT_EQ(count.size(), 600U);
  for (const auto& [frame, points] : count) EXPECT_GE(points, 28) << frame;
}

// Two minutes: each landmark in every third frame is worth more than three in each.
TEST(TrackChoice, OfALongRecordingFramesAreLeftOutEvenly) {
  constexpr int kFrames = 1500;
  const auto all = filmed(kFrames, 40, 100, [](int) { return 4.0; });
  UntrackedFrames untracked;
  const auto chosen = choose_tracks(all, 7500, &untracked);
  const auto count = in_frames(chosen);
  EXPECT_LE(chosen.size(), 7500U);
  std::int64_t before = -3;
  for (const auto& [frame, points] : count) {
    EXPECT_EQ(frame - before, 3);
    EXPECT_GE(points, static_cast<int>(kLeastInAFrame));
    before = frame;
  }
  EXPECT_EQ(before, kFrames - 3);
  EXPECT_EQ(untracked.size(), static_cast<std::size_t>(kFrames) - count.size());
  for (const auto& [frame, why] : untracked) EXPECT_EQ(why, Untracked::kBeyondLimit) << frame;
}

TEST(TrackChoice, SaysWhyAFrameHasNone) {
  auto all = filmed(100, 20, 50, [](int) { return 4.0; });
  for (int f = 200; f < 204; ++f) all.push_back({f, 100000, 4.0 * f, 0, 0.1});
  UntrackedFrames untracked;
  untracked[300] = Untracked::kNoPoint;
  EXPECT_EQ(choose_tracks(all, 10000, &untracked).size(), 2000U);
  const UntrackedFrames expected = {{200, Untracked::kTooShort},
                                    {201, Untracked::kTooShort},
                                    {202, Untracked::kTooShort},
                                    {203, Untracked::kTooShort},
                                    {300, Untracked::kNoPoint}};
  EXPECT_EQ(untracked, expected);
}

}  // namespace
}  // namespace alidade

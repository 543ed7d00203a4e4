#include "core/calibration/input_selection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <tuple>

namespace alidade::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// 10 frames, 10 samples of telemetry, 10 landmarks that are seen in each frame.
CalibrationInput small_input() {
  CalibrationInput input;
  input.width = 1920;
  input.height = 1080;
  for (int i = 0; i < 10; ++i) {
    input.frames.push_back({i, 0.1 * i, {}});
    input.telemetry.push_back({0.1 * i, 0.01 * i, 0, {}});
    for (int l = 0; l < 10; ++l) input.observations.push_back({i, l, 100.0 + l, 50, 0.3});
  }
  return input;
}

struct Selection {
  SelectedInput selected;
  CalibrationExclusions excluded;
  StageStatus status;

  explicit Selection(const CalibrationInput& input) {
    status = select_input(input, &selected, &excluded);
  }
};

TEST(InputSelection, OrdersByLandmarkAndFrameAndKnowsWhereEachItemWas) {
  const CalibrationInput input = small_input();
  const Selection s(input);
  ASSERT_TRUE(s.status.ok()) << s.status.message;
  const auto& observations = s.selected.data.observations;
  ASSERT_EQ(observations.size(), input.observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    EXPECT_EQ(observations[i].landmark, static_cast<int>(i / 10));
    EXPECT_EQ(observations[i].frame, static_cast<int>(i % 10));
    const auto& source = input.observations[s.selected.observation_index[i]];
    EXPECT_EQ(source.landmark, s.selected.landmark_name[i / 10]);
    EXPECT_EQ(source.u_px, observations[i].u.x());
  }
  EXPECT_TRUE(s.excluded.describe().empty());
}

TEST(InputSelection, OrdersBySequenceIfAllHaveOneElseByStamp) {
  CalibrationInput input = small_input();
  input.frames = {{7, 0.2, 2}, {8, 0.1, 3}, {9, 0.3, 1}};
  EXPECT_THAT(Selection(input).selected.frame_index, ElementsAre(2, 0, 1));
  input.frames[1].sequence.reset();
  EXPECT_THAT(Selection(input).selected.frame_index, ElementsAre(1, 0, 2));
}

TEST(InputSelection, TakesNoneOfALandmarkSeenTwiceInAFrame) {
  CalibrationInput input = small_input();
  input.observations.push_back({3, 4, 700, 50, 0.3});
  const Selection s(input);
  EXPECT_EQ(s.excluded.observations_duplicate, 2);
  EXPECT_EQ(s.selected.data.observations.size(), 99u);
}

TEST(InputSelection, TakesObservationsToOnePixelOutsideTheImage) {
  for (const auto& [u, v, taken] : {std::tuple{-1.0, 0.0, true},
                                    {-1.1, 0.0, false},
                                    {1921.0, 1081.0, true},
                                    {1921.0, 1081.1, false}}) {
    CalibrationInput input = small_input();
    input.observations[5].u_px = u;
    input.observations[5].v_px = v;
    EXPECT_EQ(Selection(input).excluded.observations_outside_image, taken ? 0 : 1)
        << u << ", " << v;
  }
}

TEST(InputSelection, RefusesWhatIsTooLittleOrInAnotherUnit) {
  const auto refusal = [](auto change) {
    CalibrationInput input = small_input();
    change(&input);
    return Selection(input).status.message;
  };
  EXPECT_THAT(refusal([](auto* i) { i->height = 0; }), HasSubstr("height must be positive"));
  EXPECT_THAT(refusal([](auto* i) { i->frames.resize(2); }), HasSubstr("only 2 usable frames"));
  EXPECT_THAT(refusal([](auto* i) { i->telemetry.resize(7); }),
              HasSubstr("only 7 usable telemetry"));
  EXPECT_THAT(refusal([](auto* i) { i->telemetry[3].pan_rad = 90; }), HasSubstr("degrees"));
  EXPECT_THAT(refusal([](auto* i) {
                for (auto& o : i->observations) {
                  o.u_px /= 1920;
                  o.v_px /= 1920;
                }
              }),
              HasSubstr("normalised coordinates"));
  EXPECT_THAT(refusal([](auto* i) {
                for (auto& o : i->observations) o.landmark %= 7;
              }),
              HasSubstr("only 4 landmarks"));
}

}  // namespace
}  // namespace alidade::internal

#include "core/pattern/pattern_doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/known_pattern.h"
#include "core/pattern/pattern_detector.h"
#include "test/core/pattern/pattern_simulation.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

test::PatternScene moving_scene(double duration_s) {
  test::PatternScene scene;
  scene.duration_s = duration_s;
  scene.rate_hz = 15;
  scene.seed = 3;
  return scene;
}

void name_the_other_way_round(PatternData* data, PatternFrame* frame) {
  std::reverse(frame->observations.begin(), frame->observations.end());
  for (PatternObservation& seen : frame->observations)
    seen.point = static_cast<int>(data->points_m.size()) - 1 - seen.point;
}

TEST(PatternDoubts, AMovingPatternRaisesNone) {
  EXPECT_THAT(doubts_of(test::simulate_pattern(moving_scene(8))), IsEmpty());
  EXPECT_THAT(doubts_of(PatternData()), IsEmpty());
}

// Found half turned from then on, as a symmetric pattern may be: it is bridged, and said.
TEST(PatternDoubts, OutOfViewForFiveSecondsIsBridgedAndSaid) {
  const test::PatternScene scene = moving_scene(13);
  PatternData data = test::simulate_pattern(scene);
  for (PatternFrame& frame : data.frames) {
    if (frame.time_s > 4.01 && frame.time_s < 9.01) frame.observations.clear();
    if (frame.time_s >= 9.01) name_the_other_way_round(&data, &frame);
  }
  std::string error;
  const auto pattern = parse_pattern("chessboard:9x6:30mm", &error);
  ASSERT_TRUE(pattern) << error;
  follow_half_turns(*pattern, 10 / scene.rate_hz, &data);
  EXPECT_THAT(
      doubts_of(data),
      ElementsAre(HasSubstr("the pattern was not found from 4.0 to 9.1 s; keep it in view")));
  const PatternCalibration calibration = calibrate_pattern(data);
  ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
  EXPECT_LT(std::abs(calibration.lens[index(LensParameter::kLineDelay)] - scene.lens.line_delay_s),
            4 * calibration.sigma(LensParameter::kLineDelay));
  EXPECT_LT(std::abs(calibration.lens[index(LensParameter::kFocalLengthU)] - scene.lens.f_u),
            4 * calibration.sigma(LensParameter::kFocalLengthU));
}

// A detector of whole boards finds now the one, now the other: no lens comes of it, and why is said.
TEST(PatternDoubts, TwoBoardsAreNoticed) {
  test::PatternScene scene = moving_scene(8);
  PatternData data = test::simulate_pattern(scene);
  scene.seed = 4;
  const PatternData other = test::simulate_pattern(scene);
  // Beside the first, as wide as the image away.
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    if (f % 3 != 1) continue;
    data.frames[f].observations = other.frames[f].observations;
    for (PatternObservation& seen : data.frames[f].observations) seen.u.x() += scene.width;
  }
  EXPECT_THAT(doubts_of(data), ElementsAre(HasSubstr("is a second one in view? Cover it")));
  EXPECT_NE(calibrate_pattern(data).status, PatternStatus::kOk);
}

TEST(PatternDoubts, ATagThatIsSeenTwiceIsNoticed) {
  PatternData data = test::simulate_pattern(moving_scene(2));
  for (std::size_t f = 4; f < 10; ++f) {
    auto& seen = data.frames[f].observations;
    seen.insert(seen.begin(), seen.front());
    seen.front().u.x() += 50;
  }
  EXPECT_THAT(doubts_of(data),
              ElementsAre(HasSubstr("parts of the pattern are seen twice in 6 images")));
}

}  // namespace
}  // namespace alidade

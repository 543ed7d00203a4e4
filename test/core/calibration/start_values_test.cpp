#include "core/calibration/start_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/core/calibration/adjustment_scene.h"
#include "test/support/simulated_recording.h"

namespace alidade::internal {
namespace {

test::Simulation small_simulation() {
  test::Simulation s;
  s.seed = 31;
  s.landmarks_per_field = 7;
  return s;
}

struct Started {
  SelectedInput selected;
  CalibrationExclusions excluded;
  RecordingClocks clocks;
  MotionStart motion;
  StartValues start;
  StageStatus status;

  Started(const CalibrationInput& input, const CalibrationOptions& options) {
    status = select_input(input, &selected, &excluded);
    if (!status.ok()) return;
    clocks = fit_clocks(input, options, &selected);
    status = find_motion(input, options, clocks, &selected, &motion);
    if (!status.ok()) return;
    status = start_values(input, options, clocks, motion.match, &selected, &excluded, &start);
  }
};

TEST(StartValues, AreCloseWithoutAGuess) {
  const test::Simulation s = small_simulation();
  const Started started(test::simulate(s), {});
  ASSERT_TRUE(started.status.ok()) << started.status.message;
  const AdjustmentState& state = started.start.state;
  EXPECT_NEAR(state.camera.focal_length, s.focal_length, 0.05 * s.focal_length);
  EXPECT_NEAR(state.shift_s, s.clock_offset, 0.02);
  EXPECT_EQ(started.motion.noise.resolution_rad, 0);
  EXPECT_EQ(state.landmarks.size(), started.selected.landmark_name.size());
  for (const auto& d : state.landmarks) EXPECT_NEAR(d.norm(), 1, 1e-12);
}

TEST(StartValues, FindAClockOffsetBeyondTheRangeThatIsSearchedFirst) {
  test::Simulation s = small_simulation();
  s.clock_offset = -0.4;
  CalibrationOptions options;
  options.clock_offset_search_s = 0.1;
  const Started started(test::simulate(s), options);
  ASSERT_TRUE(started.status.ok()) << started.status.message;
  EXPECT_FALSE(started.motion.match.at_edge);
  EXPECT_NEAR(started.start.state.shift_s, s.clock_offset, 0.02);
}

// Half of the telemetry is missing: frames, observations and samples that are left have each other.
TEST(StartValues, LeaveOutWhatTheOtherStreamDoesNotAccompany) {
  const test::Simulation s = small_simulation();
  CalibrationInput input = test::simulate(s);
  const std::size_t before = input.observations.size();
  input.telemetry.erase(
      std::remove_if(input.telemetry.begin(), input.telemetry.end(),
                     [](const CalibrationTelemetry& sample) { return sample.stamp_s < 5; }),
      input.telemetry.end());
  const Started started(input, {});
  ASSERT_TRUE(started.status.ok()) << started.status.message;
  const SelectedInput& selected = started.selected;
  const auto early =
      std::count_if(input.frames.begin(), input.frames.end(), [&](const CalibrationFrame& frame) {
        return frame.stamp_s + started.motion.match.shift_s < input.telemetry.front().stamp_s;
      });
  // The stamp of a frame at the border may err to either side.
  EXPECT_NEAR(started.excluded.frames_without_telemetry, static_cast<double>(early), 1);
  ASSERT_EQ(selected.data.observations.size(), selected.observation_index.size());
  EXPECT_LT(selected.data.observations.size(), 0.6 * static_cast<double>(before));
  for (std::size_t i = 0; i < selected.data.observations.size(); ++i) {
    const auto& o = selected.data.observations[i];
    const auto& source = input.observations[selected.observation_index[i]];
    EXPECT_EQ(source.u_px, o.u.x());
    EXPECT_EQ(source.landmark, selected.landmark_name[static_cast<std::size_t>(o.landmark)]);
    EXPECT_GE(selected.data.frame_time_s[static_cast<std::size_t>(o.frame)] +
                  started.motion.match.shift_s,
              5 - 0.01);
  }
}

// Each where the mount looked when its row was exposed: the read-out lasts half a second here.
TEST(StartValues, LandmarksLieWhereTheirRowsSawThem) {
  const test::AdjustmentScene scene = test::make_adjustment_scene(0.5);
  AdjustmentState state = scene.state;
  for (auto& landmark : state.landmarks) landmark.setZero();
  initialise_landmarks(scene.data, &state);
  int seen = 0;
  for (const auto& observation : scene.data.observations) {
    const auto l = static_cast<std::size_t>(observation.landmark);
    EXPECT_LE((state.landmarks[l] - scene.state.landmarks[l]).norm(), 1e-9) << l;
    ++seen;
  }
  EXPECT_GT(seen, 200);
}

TEST(PriorKnowledge, HoldsWhatIsExactAndScalesWhatIsNot) {
  CalibrationOptions options;
  options.focal_length = CalibrationPrior{4000, 40};
  options.line_delay = CalibrationPrior{10e-6, 0};
  options.clock_offset = CalibrationPrior{0.1, 3e-3};
  RecordingClocks clocks;
  clocks.image.offset_sigma_s = 4e-3;
  const PriorKnowledge known = prior_knowledge(1920, 1080, options, clocks, 1234);
  const auto at = [](Parameter p) { return static_cast<std::size_t>(index(p)); };
  EXPECT_EQ(known.priors.mean.camera.focal_length, 4000);
  EXPECT_NEAR(known.priors.information[index(Parameter::kFocalLength)], 1e4, 1e-6);
  EXPECT_TRUE(known.fixed[at(Parameter::kLineDelay)]);
  EXPECT_EQ(known.priors.mean.readout_s, 10e-6 * 1080);
  EXPECT_TRUE(known.fixed[at(Parameter::kAspect)]);
  // What the stamps leave open comes on top: 3 and 4 make 5.
  EXPECT_NEAR(known.priors.information[index(Parameter::kClockOffset)], 1 / 25e-6, 1e-3);
  EXPECT_EQ(known.priors.information[index(Parameter::kRadialDistortion)], 0);
  EXPECT_FALSE(known.fixed[at(Parameter::kRadialDistortion)]);
  EXPECT_TRUE(known.fixed[static_cast<std::size_t>(kDrift)]) << "no steady clocks, no drift";
}

}  // namespace
}  // namespace alidade::internal

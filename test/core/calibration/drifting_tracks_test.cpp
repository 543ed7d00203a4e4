// Through calibrate(): what moves in the picture.
#include "core/calibration/drifting_tracks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <unordered_map>

#include "core/calibration/calibrate.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using test::calibration_error;
using test::draw_base_simulation;
using test::simulate;
using test::Simulation;

// Of ten landmarks as many as `clouds` drift to the right.
CalibrationInput with_clouds(const Simulation& s, int clouds, double px_s) {
  CalibrationInput input = simulate(s);
  std::unordered_map<std::int64_t, double> time;
  for (const CalibrationFrame& frame : input.frames) time[frame.frame] = frame.stamp_s;
  for (CalibrationObservation& o : input.observations) {
    if (o.landmark % 10 < clouds)
      o.u_px += px_s * (time.at(o.frame) - input.frames.front().stamp_s);
  }
  return input;
}

TEST(DriftingTracks, AreNoneWhereAllStandsStill) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const CalibrationResult result = calibrate(simulate(draw_base_simulation(seed)));
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_EQ(result.exclusions.observations_drifting, 0) << seed;
  }
}

TEST(DriftingTracks, AreLeftOutBeTheyTheMost) {
  for (const double px_s : {1.5, -6.0}) {
    const Simulation s = draw_base_simulation(31);
    const CalibrationInput input = with_clouds(s, 6, px_s);
    const CalibrationResult result = calibrate(input);
    ASSERT_TRUE(result.ok()) << result.message;
    double clouds = 0;
    for (const CalibrationObservation& o : input.observations)
      clouds += o.landmark % 10 < 6 ? 1 : 0;
    EXPECT_GT(clouds, 0.4 * static_cast<double>(input.observations.size()));
    // Those seen for long.
    EXPECT_GT(result.exclusions.observations_drifting, 0.7 * clouds);
    // Ground that is beside them in doubt may go, too; enough stays.
    EXPECT_LT(result.exclusions.observations_drifting,
              0.85 * static_cast<double>(input.observations.size()));
    const auto error = calibration_error(s, result.calibration);
    for (int i = 0; i < kParameterCount; ++i) {
      EXPECT_LE(std::abs(error[i]), 4.5 * std::sqrt(result.calibration.covariance(i, i)) + 1e-15)
          << to_string(static_cast<Parameter>(i)) << ", " << px_s << " px/s";
    }
  }
}

}  // namespace
}  // namespace alidade

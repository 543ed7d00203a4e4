// Observations that a calibration did not use, predicted by it.

#include "core/calibration/held_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::Gt;
using ::testing::Lt;
using ::testing::Optional;

// A calibration of nine frames of ten, and the observations of the tenth.
class HeldOutTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    test::Simulation s;
    s.seed = 5;
    s.pixel_sigma = 0.1;
    CalibrationInput input = test::simulate(s);
    std::vector<CalibrationObservation> used;
    for (const CalibrationObservation& seen : input.observations)
      (seen.frame % 10 == 5 ? held_out_ : used).push_back(seen);
    input.observations = used;
    result_ = new CalibrationResult(calibrate(input));
    for (const FrameResult& frame : result_->frames) times_[frame.frame] = frame.time_s;
    // Between two neighbours that were used, of a steady clock.
    for (const FrameResult& frame : result_->frames) {
      const auto after = times_.find(frame.frame + 2);
      if ((frame.frame + 1) % 10 == 5 && after != times_.end())
        times_[frame.frame + 1] = (frame.time_s + after->second) / 2;
    }
  }
  static void TearDownTestSuite() {
    delete result_;
    held_out_.clear();
    times_.clear();
  }

  static std::vector<CalibrationObservation> with_sigmas(double factor) {
    std::vector<CalibrationObservation> observations = held_out_;
    for (CalibrationObservation& seen : observations) seen.sigma_px *= factor;
    return observations;
  }

  static CalibrationResult* result_;
  static std::vector<CalibrationObservation> held_out_;
  static FrameTimes times_;
};
CalibrationResult* HeldOutTest::result_ = nullptr;
std::vector<CalibrationObservation> HeldOutTest::held_out_;
FrameTimes HeldOutTest::times_;

// The median of n chi-squares scatters by about 1.4 / sqrt(n) of itself; its root by half of that. n > 500.
TEST_F(HeldOutTest, IsOneWhereTheSigmasAreRight) {
  ASSERT_TRUE(result_->ok());
  ASSERT_GT(held_out_.size(), 500U);
  EXPECT_THAT(held_out_error(held_out_, times_, *result_), Optional(DoubleNear(1, 0.1)));
}

TEST_F(HeldOutTest, CountsInStatedSigmas) {
  // The landmarks' own covariance does not shrink with the observations' sigmas.
  EXPECT_THAT(held_out_error(with_sigmas(1.0 / 3), times_, *result_),
              Optional(AllOf(Gt(2), Lt(3.3))));
  EXPECT_THAT(held_out_error(with_sigmas(100), times_, *result_),
              Optional(DoubleNear(0.01, 0.001)));
}

TEST_F(HeldOutTest, AFifthOfOutliersHardlyMovesIt) {
  std::vector<CalibrationObservation> observations = held_out_;
  for (std::size_t i = 0; i < observations.size(); i += 5) observations[i].u_px += 100;
  EXPECT_THAT(held_out_error(observations, times_, *result_), Optional(Lt(1.35)));
}

TEST_F(HeldOutTest, SeesAFrameAtAWrongTime) {
  FrameTimes late = times_;
  // 10 ms of a path that turns a field of view in seconds: many px.
  for (auto& [frame, time_s] : late) time_s += 0.01;
  EXPECT_THAT(held_out_error(held_out_, late, *result_), Optional(Gt(10)));
}

TEST_F(HeldOutTest, IsNothingWithoutATimeOrALandmark) {
  EXPECT_EQ(held_out_error({}, times_, *result_), std::nullopt);
  EXPECT_EQ(held_out_error(held_out_, {}, *result_), std::nullopt);
  std::vector<CalibrationObservation> unknown = held_out_;
  for (CalibrationObservation& seen : unknown) seen.landmark += 1000000;
  EXPECT_EQ(held_out_error(unknown, times_, *result_), std::nullopt);
}

}  // namespace
}  // namespace alidade

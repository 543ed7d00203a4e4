#include "core/calibration/sufficiency.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace alidade::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A good calibration of every parameter; the tests spoil one.
CalibrationResult good_result() {
  CalibrationResult result;
  Calibration& c = result.calibration;
  c.camera = {2000, 1, {0.1}, 1920, 1080};
  c.line_delay = 10e-6;
  c.clock_offset = 0.02;
  const auto set = [&c](Parameter p, double sigma) {
    c.covariance(index(p), index(p)) = sigma * sigma;
  };
  set(Parameter::kFocalLength, 1);
  set(Parameter::kRadialDistortion, 1e-3);
  set(Parameter::kLineDelay, 1e-8);
  set(Parameter::kClockOffset, 1e-4);
  return result;
}

const MotionExtent kMotion = {{1, 1}, {0.1, 0.1}, {0.05, 0.05}};

CalibrationResult judged_with(Parameter parameter, double sigma) {
  CalibrationResult result = good_result();
  result.calibration.covariance(index(parameter), index(parameter)) = sigma * sigma;
  judge({}, kMotion, &result);
  return result;
}

// The limits of use, in the units in which they hurt.
struct Limit {
  Parameter parameter;
  double sigma;
  const char* words;
};

class JudgeAtItsLimits : public testing::TestWithParam<Limit> {};

TEST_P(JudgeAtItsLimits, PublishesWhatIsJustGoodEnoughAndNothingBeyond) {
  const Limit& limit = GetParam();
  const CalibrationResult below = judged_with(limit.parameter, 0.999 * limit.sigma);
  EXPECT_EQ(below.status, CalibrationStatus::kOk) << below.message;
  ASSERT_TRUE(below.goals);
  EXPECT_EQ(farthest_goal(*below.goals), nullptr);
  const CalibrationResult above = judged_with(limit.parameter, 1.001 * limit.sigma);
  EXPECT_EQ(above.status, CalibrationStatus::kWeak);
  EXPECT_THAT(above.message, HasSubstr(limit.words));
  // What is told of the progress is what was judged, and the refusal asks for the same motion.
  const ParameterGoal* weakest = farthest_goal(above.goals.value());
  ASSERT_NE(weakest, nullptr);
  EXPECT_EQ(weakest->parameter, limit.parameter);
  EXPECT_NEAR(*weakest->sigma / weakest->wanted, 1.001, 1e-9);
  EXPECT_THAT(above.message, HasSubstr(std::string(": ") + to_string(weakest->helps)));
}

// Half the diagonal of 1920 x 1080 px, in units of the focal length of 2000 px.
const double kCorner = std::sqrt(960.0 * 960 + 540.0 * 540) / 2000;

INSTANTIATE_TEST_SUITE_P(
    Sufficiency, JudgeAtItsLimits,
    testing::Values(Limit{Parameter::kFocalLength, 0.05 * 2000,
                          "focal length known to 5.0 % only, 5 % are needed"},
                    Limit{Parameter::kClockOffset, 0.01,
                          "clock offset known to 10.0 ms only, 10 ms are needed"},
                    Limit{Parameter::kLineDelay, 5e-3 / 1080,
                          "read-out known to 5.0 ms only, 5 ms are needed"},
                    Limit{Parameter::kRadialDistortion, 0.02 / (kCorner * kCorner),
                          "radial distortion known to 2.0 % of the radius only, 2 % are needed"}),
    [](const auto& limit) { return std::string(to_string(limit.param.parameter)); });

TEST(CalibrationGoals, TheFarthestIsTheOneWhoseSigmaIsMostTimesWhatIsWanted) {
  ParameterGoals goals = calibration_goals(Camera<double>{2000, 1, {0}, 1920, 1080});
  EXPECT_EQ(farthest_goal(goals), nullptr);  // none has a sigma yet
  for (ParameterGoal& goal : goals) goal.sigma = 2 * goal.wanted;
  goals[2].sigma = 3 * goals[2].wanted;
  EXPECT_EQ(farthest_goal(goals), &goals[2]);
  goals[2].reached = true;
  EXPECT_EQ(farthest_goal(goals), &goals[0]);
}

// A scale that only its prior knows cannot be told from the focal length: more motion is no help.
TEST(Judge, CallsAFocalLengthReachedThatOnlyTheScaleLeavesOpen) {
  CalibrationOptions options;
  options.pan_scale.sigma = 0.1;
  CalibrationResult result = good_result();
  auto& cov = result.calibration.covariance;
  const int f = index(Parameter::kFocalLength);
  const int s = index(Parameter::kPanScale);
  cov(f, f) = std::pow(0.1 * 2000, 2);
  cov(s, s) = std::pow(0.1, 2);
  cov(f, s) = cov(s, f) = 0.99 * 0.1 * 2000 * 0.1;
  judge(options, kMotion, &result);
  EXPECT_EQ(result.status, CalibrationStatus::kOk);
  EXPECT_EQ(farthest_goal(result.goals.value()), nullptr);
  EXPECT_GT(*result.goals->front().sigma, result.goals->front().wanted);
}

TEST(Judge, NamesTheParametersThatAreUncertainTogether) {
  CalibrationResult result = good_result();
  auto& cov = result.calibration.covariance;
  const int f = index(Parameter::kFocalLength);
  const int k = index(Parameter::kRadialDistortion);
  cov(f, k) = cov(k, f) = -0.99 * std::sqrt(cov(f, f) * cov(k, k));
  judge({}, kMotion, &result);
  EXPECT_THAT(result.quality.weakest_direction, HasSubstr("focal_length up"));
  EXPECT_THAT(result.quality.weakest_direction, HasSubstr("radial_distortion down"));
  // Eigenvalues of a correlation of 0.99 are 1.99 and 0.01.
  EXPECT_NEAR(result.quality.condition, 199, 1e-6);
}

TEST(Judge, SaysOfAnAxisThatOnlyItsPriorHoldsIt) {
  CalibrationOptions options;
  for (const double share : {0.69, 0.71}) {
    CalibrationResult result = good_result();
    const int axis = index(Parameter::kPanAxis1);
    result.calibration.covariance(axis, axis) = std::pow(share * options.axis_sigma_rad, 2);
    judge(options, kMotion, &result);
    EXPECT_EQ(result.status, CalibrationStatus::kOk);
    EXPECT_EQ(result.quality.advice.size(), share > 0.7 ? 1u : 0u);
  }
}

// A cause that is known is in the sigmas.
TEST(Judge, RefusesPartsThatContradictEachOtherWithoutACause) {
  for (const double scatter : {29.0, 31.0}) {
    CalibrationResult result = good_result();
    result.quality.contradiction = {"clock_offset", "runs of pan", scatter};
    judge({}, kMotion, &result);
    EXPECT_EQ(result.status, scatter > 30 ? CalibrationStatus::kWeak : CalibrationStatus::kOk);
    EXPECT_THAT(result.message, HasSubstr("clock_offset"));
    result.message.clear();
    result.quality.causes = {{"play", 300, 2, 0.3, "mrad"}};
    judge({}, kMotion, &result);
    EXPECT_EQ(result.status, CalibrationStatus::kOk);
    EXPECT_THAT(result.message, HasSubstr("likeliest cause: play, 0.3 mrad"));
  }
}

// The file of such a calibration could not be read.
TEST(Judge, RefusesAnAxisThatComesOutTurnedOver) {
  CalibrationResult result = good_result();
  result.calibration.mechanics.tilt_axis = -Vector3<double>::UnitY();
  judge({}, kMotion, &result);
  EXPECT_EQ(result.status, CalibrationStatus::kTelemetryMismatch);
  EXPECT_THAT(result.message, HasSubstr("180 deg from where it should lie: is tilt up positive?"));
  MotionExtent little = kMotion;
  little.range[1] = 0.1;
  judge({}, little, &result);
  EXPECT_EQ(result.status, CalibrationStatus::kOneAxisOnly);
  EXPECT_THAT(result.message, HasSubstr("tilt moves the image by 200 px"));
}

// The mount turns at a steady rate with a sine on top. With amplitude a of the rate, relative to its mean v, the rate's
// standard deviation is a v / sqrt(2), and its largest value (1 + a) v: their ratio is the variation.
TrajectorySpline turning(double amplitude) {
  constexpr double kRate = 0.05;  // rad/s
  constexpr double kPeriod = 2;   // s
  std::vector<double> knots;
  for (int i = 0; i <= 200; ++i) knots.push_back(0.05 * i);
  TrajectorySpline spline(knots);
  for (int i = 0; i < spline.control_points(); ++i) {
    const double t = 0.05 * (i - 1);
    const double angle =
        kRate * t + amplitude * kRate * kPeriod / (2 * kPi) * std::sin(2 * kPi * t / kPeriod);
    spline.control_point(i) = {angle, 0.6 * angle};
  }
  return spline;
}

CalibrationStatus status_at(double amplitude, double correlation = 0.99,
                            double focal_length = 2000) {
  CalibrationInput input;
  input.width = 1920;
  input.height = 1080;
  std::vector<ImageMotion> motion;
  for (int i = 0; i <= 190; ++i) motion.push_back({0.05 * i, 0.05 * i + 0.5, {-50, 30}});
  MotionMatch match;
  match.correlation = correlation;
  match.focal_length = focal_length;
  std::string why;
  return check_motion(motion, turning(amplitude), match, input, &why);
}

TEST(CheckMotion, NeedsARateThatVariesByATwentieth) {
  // a / sqrt(2) = 0.05 (1 + a); control points are sampled from the path, which a spline of 20 knots a second
  // follows to (2 pi / 2 s * 0.05 s)^2 / 6 = 0.4 %.
  const double limit = 0.05 / (1 / std::sqrt(2.0) - 0.05);
  EXPECT_EQ(status_at(0.99 * limit), CalibrationStatus::kConstantVelocity);
  EXPECT_EQ(status_at(1.01 * limit), CalibrationStatus::kOk);
}

TEST(CheckMotion, NeedsTelemetryThatDescribesTheVideo) {
  EXPECT_EQ(status_at(0.5, 0.59), CalibrationStatus::kTelemetryMismatch);
  EXPECT_EQ(status_at(0.5, 0.61), CalibrationStatus::kOk);
}

// A fifth of the width: 136 degrees.
TEST(CheckMotion, RefusesAFieldOfViewThatNoLensHas) {
  EXPECT_EQ(status_at(0.5, 0.99, 0.199 * 1920), CalibrationStatus::kBadInput);
  EXPECT_EQ(status_at(0.5, 0.99, 0.201 * 1920), CalibrationStatus::kOk);
}

TEST(MeasureMotion, FindsRangeAndRates) {
  std::vector<double> times;
  for (int i = 0; i <= 50; ++i) times.push_back(0.2 * i);
  const MotionExtent extent = measure_motion(turning(0), times);
  EXPECT_NEAR(extent.range[0], 0.5, 1e-9);
  EXPECT_NEAR(extent.largest_rate[1], 0.03, 1e-9);
  EXPECT_NEAR(extent.varying_rate[0], 0, 1e-6);
}

TEST(AskForDegrees, OnlyWhereTheFieldIsWide) {
  EXPECT_THAT(ask_for_degrees(3 * 1920 + 1, 1920), IsEmpty());
  EXPECT_THAT(ask_for_degrees(1000, 1920), HasSubstr("about 57296 px"));
}

}  // namespace
}  // namespace alidade::internal

// The calibration thread's work, step by step, on simulated cameras with known truth: when it publishes, what
// it asks for, what it does when the camera changes.

#include "edge_app/self_calibration/self_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <time.h>

#include <functional>
#include <optional>
#include <thread>

#include "test/edge_app/self_calibration/fed_calibration.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using test::expect_truth;
using test::feed;
using test::Feed;
using test::MemoryArchive;
using test::Published;

test::Simulation camera() { return test::calibrated_camera(); }

SelfCalibrationOptions options_for(const test::Simulation& s) {
  return test::calibration_options(s);
}

// The motion goes on, behind that of the first recording, with OE mode's tracks.
Feed later_in_oe_mode() {
  return {FrameTracks::Tracker::kOe, {}, 20, false, std::numeric_limits<double>::infinity(), 1000};
}

TEST(SelfCalibration, BeginsWithTheDataSheetAndPublishesOnceTheMotionSuffices) {
  const test::Simulation s = camera();
  const SelfCalibrationOptions options = options_for(s);
  SelfCalibration calibration(options, nullptr);
  EXPECT_FALSE(calibration.first()->calibrated);
  EXPECT_EQ(calibration.first()->calibration.camera.focal_length,
            options.data_sheet.camera.focal_length);
  const auto published = feed(&calibration, s, {});
  ASSERT_FALSE(published.empty());
  EXPECT_TRUE(published[0].calibration->calibrated);
  EXPECT_GE(published[0].time_s, options.schedule.first_try_s);
  expect_truth(s, published[0].calibration->calibration);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kNothing);
  EXPECT_FALSE(calibration.progress());
  EXPECT_THAT(test::lines_of(calibration), Contains(HasSubstr("calibrated from")));
  EXPECT_THAT(test::lines_of(calibration), IsEmpty());
}

TEST(SelfCalibration, HearsNothingWhileItIsNotAutomatic) {
  const test::Simulation s = camera();
  SelfCalibrationOptions options = options_for(s);
  options.automatic = false;
  SelfCalibration calibration(options, nullptr);
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kOff);
  EXPECT_FALSE(calibration.progress());
  EXPECT_FALSE(calibration.ask_for_fresh());
}

struct Unsuitable {
  const char* name;
  std::function<Eigen::Vector2d(double)> path;
  CalibrationNeed need;
};

class SelfCalibrationNeeds : public ::testing::TestWithParam<Unsuitable> {};

TEST_P(SelfCalibrationNeeds, SaysWhatIsMissingAndPublishesNothing) {
  test::Simulation s = camera();
  s.path = GetParam().path;
  SelfCalibration calibration(options_for(s), nullptr);
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kCollecting);
  EXPECT_STREQ(to_string(calibration.report().need), to_string(GetParam().need));
  EXPECT_THAT(test::lines_of(calibration), Contains(HasSubstr("not calibrated yet")));
}

INSTANTIATE_TEST_SUITE_P(
    Motions, SelfCalibrationNeeds,
    ::testing::Values(
        Unsuitable{"Rest", [](double) { return Eigen::Vector2d(0.1, 0.05); },
                   CalibrationNeed::kMotion},
        Unsuitable{"ConstantVelocity", [](double x) { return Eigen::Vector2d(0.1 * x, 0.02 * x); },
                   CalibrationNeed::kAcceleration},
        Unsuitable{"PanOnly", [](double x) { return Eigen::Vector2d(0.4 * std::sin(x), 0.0); },
                   CalibrationNeed::kTilt},
        Unsuitable{"TiltOnly", [](double x) { return Eigen::Vector2d(0.0, 0.4 * std::sin(x)); },
                   CalibrationNeed::kPan}),
    [](const auto& p) { return p.param.name; });

// What is told at the moment at which the first try is due.
struct FirstTold {
  std::optional<CalibrationProgress> progress;
  CalibrationNeed need = CalibrationNeed::kNothing;
};

FirstTold before_the_first_try(SelfCalibration* calibration, const test::Simulation& s) {
  FirstTold told;
  Feed how;
  how.before_adjusting = [&] {
    if (told.progress) return;
    told = {calibration->progress(), calibration->report().need};
  };
  static_cast<void>(feed(calibration, s, how));
  return told;
}

TEST(SelfCalibration, TellsItsGoalsAndTheMotionThatIsMissingBeforeItsFirstTry) {
  test::Simulation s = camera();
  s.path = [](double x) { return Eigen::Vector2d(0.4 * std::sin(x), 0.0); };
  const SelfCalibrationOptions options = options_for(s);
  SelfCalibration calibration(options, nullptr);
  const FirstTold told = before_the_first_try(&calibration, s);
  EXPECT_STREQ(to_string(told.need), to_string(CalibrationNeed::kTilt));
  ASSERT_TRUE(told.progress);
  EXPECT_EQ(told.progress->attempts, 0);
  EXPECT_EQ(told.progress->refusal, "");
  EXPECT_GE(told.progress->span_s, options.schedule.first_try_s);
  for (const ParameterGoal& goal : told.progress->goals) {
    EXPECT_FALSE(goal.sigma) << to_string(goal.parameter);
    EXPECT_GT(goal.wanted, 0);
    EXPECT_FALSE(goal.reached);
  }
  const auto& range = told.progress->coverage.range;
  ASSERT_TRUE(range);
  EXPECT_NEAR(range->largest.pan - range->least.pan, 0.8, 0.02);
  EXPECT_LT(range->largest.tilt - range->least.tilt, told.progress->travel.least);
  // Afterwards the attempts, and what was said of the last.
  const std::optional<CalibrationProgress> later = calibration.progress();
  ASSERT_TRUE(later);
  EXPECT_GT(later->attempts, 1);
  EXPECT_THAT(later->refusal, HasSubstr("not calibrated yet (one axis only): tilt"));
}

// The sigmas by which the thread decided, and one word for the motion that helps: of the record, and
// of the line that says why there is no calibration.
TEST(SelfCalibration, TellsByWhichSigmasItDecidedAndAsksForTheMotionThatTheWorstNeeds) {
  test::Simulation s = camera();
  // Slowly, and seen with much noise: all but the line delay shows.
  const double reach = 0.04 * s.field_of_view();
  s.path = [reach](double x) {
    return Eigen::Vector2d(reach * std::sin(0.3 * x), 0.8 * reach * std::cos(0.51 * x));
  };
  s.pixel_sigma = 3;
  s.duration_s = 9;
  SelfCalibration calibration(options_for(s), nullptr);
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  const std::optional<CalibrationProgress> progress = calibration.progress();
  ASSERT_TRUE(progress);
  const ParameterGoal* worst = farthest_goal(progress->goals);
  ASSERT_NE(worst, nullptr) << progress->refusal;
  EXPECT_EQ(worst->parameter, Parameter::kLineDelay);
  EXPECT_GT(*worst->sigma, worst->wanted);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kFaster);
  EXPECT_STREQ(to_string(calibration.report().need), to_string(worst->helps));
  EXPECT_THAT(progress->refusal, HasSubstr(to_string(worst->helps)));
  for (const ParameterGoal& goal : progress->goals) {
    ASSERT_TRUE(goal.sigma);
    EXPECT_EQ(goal.reached, &goal != worst) << to_string(goal.parameter);
  }
}

TEST(SelfCalibration, AsksForTextureWhereHardlyAnythingIsSeen) {
  test::Simulation s = camera();
  s.landmarks_per_field = 1.4;
  SelfCalibration calibration(options_for(s), nullptr);
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  EXPECT_STREQ(to_string(calibration.report().need), to_string(CalibrationNeed::kTexture));
}

TEST(SelfCalibration, DoesNotBelieveTelemetryOfAnotherMotion) {
  test::Simulation s = camera();
  // The head reports the motion mirrored.
  s.pan_scale = -1;
  SelfCalibration calibration(options_for(s), nullptr);
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  EXPECT_STREQ(to_string(calibration.report().need), to_string(CalibrationNeed::kAgreement));
}

// A machine with too much to do leaves out most pictures, at random, and stamps late what it takes up.
class StarvedCalibration : public ::testing::Test {
 protected:
  std::vector<Published> starve(double taken_up, double late_s, double duration_s) {
    s_.duration_s = duration_s;
    Feed starved;
    starved.taken_up = taken_up;
    starved.late_s = late_s;
    return feed(&calibration_, s_, starved);
  }
  test::Simulation s_ = camera();
  SelfCalibration calibration_{options_for(s_), nullptr};
};

TEST_F(StarvedCalibration, SucceedsWithOneInThreePictures) {
  const auto published = starve(0.3, 0.05, 10);
  ASSERT_FALSE(published.empty());
  expect_truth(s_, published[0].calibration->calibration);
}

TEST_F(StarvedCalibration, SaysThatTheMachineIsTooBusyAndDoesNotBlameTelemetry) {
  EXPECT_THAT(starve(0.15, 1, 10), IsEmpty());
  EXPECT_STREQ(to_string(calibration_.report().need), to_string(CalibrationNeed::kPictures));
  EXPECT_THAT(test::lines_of(calibration_),
              AllOf(Not(IsEmpty()), Each(HasSubstr("% of the pictures came here")),
                    Each(Not(HasSubstr("telemetry does not")))));
}

// The head's connection was lost during the video: what was before is forgotten.
TEST(SelfCalibration, DoesNotBlameTelemetryForWhatItDoesNotAccompany) {
  const test::Simulation s = camera();
  SelfCalibrationOptions options = options_for(s);
  SelfCalibration calibration(options, nullptr);
  Feed lost;
  lost.head_back_s = options.schedule.first_try_s - 1;
  const auto published = feed(&calibration, s, lost);
  const std::vector<std::string> messages = test::lines_of(calibration);
  ASSERT_GE(messages.size(), 2U);
  EXPECT_THAT(messages[0], HasSubstr("telemetry accompanies less than half of the video"));
  EXPECT_THAT(messages, Each(Not(HasSubstr("telemetry does not describe"))));
  ASSERT_FALSE(published.empty());
  expect_truth(s, published[0].calibration->calibration);
}

TEST(SelfCalibration, NamesTheStreamThatIsLost) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  calibration.video_lost();
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kVideo);
  FrameTracks frame;
  frame.stamp.receive_time_s = 1;
  calibration.add(frame);
  calibration.telemetry_lost();
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kTelemetry);
}

TEST(SelfCalibration, LaterMotionRefinesWhatIsKnown) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  const auto first = feed(&calibration, s, {});
  ASSERT_FALSE(first.empty());
  test::Simulation later = s;
  later.seed = 4;
  const auto refined = feed(&calibration, later, later_in_oe_mode());
  ASSERT_FALSE(refined.empty());
  const Calibration& before = first.back().calibration->calibration;
  const Calibration& after = refined.back().calibration->calibration;
  expect_truth(s, after);
  EXPECT_LT(after.covariance(0, 0), before.covariance(0, 0));
}

TEST(SelfCalibration, FindsTheOpticalCentreAndKeepsIt) {
  test::Simulation s = camera();
  s.radial_distortion = 0.4;  // 3 % in the corner
  s.optical_centre_offset_px = {24, -15};
  SelfCalibrationOptions options = options_for(s);
  options.adjustment.centre_sigma_px = 19;
  SelfCalibration calibration(options, nullptr);
  const auto first = feed(&calibration, s, {});
  ASSERT_FALSE(first.empty());
  const Calibration& before = first.front().calibration->calibration;
  EXPECT_NEAR(before.camera.centre_u, 24, 3);
  EXPECT_NEAR(before.camera.centre_v, -15, 3);
  EXPECT_EQ(parameter_sigma(before, Parameter::kCentreU), 0);
  EXPECT_NEAR(before.camera.distortion.radial, 0.4,
              5 * parameter_sigma(before, Parameter::kRadialDistortion));
  test::Simulation later = s;
  later.seed = 4;
  const auto refined = feed(&calibration, later, later_in_oe_mode());
  ASSERT_FALSE(refined.empty());
  const Calibration& after = refined.back().calibration->calibration;
  EXPECT_EQ(after.camera.centre_offset(), before.camera.centre_offset());
  EXPECT_LT(after.covariance(0, 0), before.covariance(0, 0));
  EXPECT_THAT(test::lines_of(calibration),
              Not(Contains(HasSubstr("the camera is not what the calibration says"))));
}

TEST(SelfCalibration, TakesTheMiddleForTheCentreUnlessItIsShown) {
  const test::Simulation s = camera();
  SelfCalibrationOptions options = options_for(s);
  options.adjustment.centre_sigma_px = 19;
  SelfCalibration calibration(options, nullptr);
  const auto published = feed(&calibration, s, {});
  ASSERT_FALSE(published.empty());
  EXPECT_FALSE(published.back().calibration->calibration.has_centre());
  expect_truth(s, published.back().calibration->calibration);
}

TEST(SelfCalibration, MakesAFreshCalibrationOfTheMotionSinceItWasAskedFor) {
  const test::Simulation s = camera();
  const SelfCalibrationOptions options = options_for(s);
  SelfCalibration calibration(options, nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  ASSERT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
  // So little that it would only be watched, for long.
  test::Simulation turned = s;
  turned.pan_axis = (s.pan_axis + Eigen::Vector3d(0, 0.005, 0)).normalized();
  EXPECT_TRUE(calibration.ask_for_fresh());
  const auto published = feed(&calibration, turned, later_in_oe_mode());
  ASSERT_FALSE(published.empty());
  EXPECT_GE(published[0].time_s, options.schedule.first_try_s);
  EXPECT_LT(published[0].time_s, 12);  // of motion, from when on it is held against the old one
  expect_truth(turned, published[0].calibration->calibration);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kNothing);
}

TEST(SelfCalibration, KeepsTheOldCalibrationUntilTheFreshOneIsThereAndSaysWhatThatNeeds) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  static_cast<void>(test::lines_of(calibration));
  EXPECT_TRUE(calibration.ask_for_fresh());
  test::Simulation still = s;
  still.path = [](double) { return Eigen::Vector2d(0.1, 0.05); };
  EXPECT_THAT(feed(&calibration, still,
                   {FrameTracks::Tracker::kOe,
                    {},
                    20,
                    false,
                    std::numeric_limits<double>::infinity(),
                    1000}),
              IsEmpty());
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kMotion);
  ASSERT_TRUE(calibration.progress());
  EXPECT_THAT(calibration.progress()->refusal, HasSubstr("no fresh calibration yet (no motion)"));
  EXPECT_THAT(test::lines_of(calibration), Contains(HasSubstr("no fresh calibration yet")));
}

// Where in its interval a device answers, it does so in every poll, however many there are.
TEST(SelfCalibration, RefiningDoesNotAverageOutWhatAllPollsHaveInCommon) {
  test::Simulation s = camera();
  s.duration_s = 40;
  Feed polls;
  polls.poll_s = 6e-3;
  SelfCalibration calibration(options_for(s), nullptr);
  const std::vector<Published> published = feed(&calibration, s, polls);
  ASSERT_GE(published.size(), 2U);
  const int d = index(Parameter::kClockOffset);
  for (const Published& p : published) {
    const Calibration& found = p.calibration->calibration;
    const double sigma_s = std::sqrt(found.covariance(d, d));
    EXPECT_GE(sigma_s, polls.poll_s / std::sqrt(12.0));
    // The samples were true at the end of their intervals.
    EXPECT_LT(std::abs(test::calibration_error(s, found)[d]), 3 * sigma_s);
  }
}

TEST(SelfCalibration, ReplacesTheCalibrationOfACameraThatWasTurnedOnItsMount) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  test::Simulation turned = s;
  turned.pan_axis = (s.pan_axis + Eigen::Vector3d(0, 0.005, 0)).normalized();
  turned.tilt_axis = (s.tilt_axis + Eigen::Vector3d(0.005, 0, 0)).normalized();
  turned.duration_s = 40;
  const auto published = feed(&calibration, turned, later_in_oe_mode());
  ASSERT_FALSE(published.empty());
  expect_truth(turned, published.back().calibration->calibration);
  EXPECT_THAT(test::lines_of(calibration),
              Contains(HasSubstr("the camera is not what the calibration says")));
}

// The second contradiction cannot come while the delay wanders.
TEST(SelfCalibration, WidensWhatIsContradictedWhenTheDelayBeginsToWander) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  const Calibration before = calibration.first()->calibration;
  static_cast<void>(test::lines_of(calibration));
  test::Simulation turned = s;
  turned.pan_axis = (s.pan_axis + Eigen::Vector3d(0, 0.005, 0)).normalized();
  turned.tilt_axis = (s.tilt_axis + Eigen::Vector3d(0.005, 0, 0)).normalized();
  turned.duration_s = 40;
  Feed how;
  how.tracker = FrameTracks::Tracker::kOe;
  how.from_s = 20;
  how.first_frame = 1000;
  bool contradicted = false;
  how.wander_at = [&](double) {
    for (const std::string& line : test::lines_of(calibration)) {
      contradicted = contradicted || line.find("not what the calibration says") != line.npos;
    }
    return contradicted ? 0.05 : 0.0;
  };
  const auto published = feed(&calibration, turned, how);
  ASSERT_EQ(published.size(), 1U);
  const PublishedCalibration& widened = *published[0].calibration;
  EXPECT_TRUE(widened.calibrated);
  EXPECT_EQ(widened.calibration.camera.focal_length, before.camera.focal_length);
  const double growth = widened.calibration.covariance(0, 0) / before.covariance(0, 0);
  EXPECT_GT(growth, 60.0 / 8);
  EXPECT_NEAR(widened.calibration.covariance(5, 5) / before.covariance(5, 5), growth,
              1e-9 * growth);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
}

TEST(SelfCalibration, WithdrawsWhatLandmarksContradictForLong) {
  const test::Simulation s = camera();
  SelfCalibrationOptions options = options_for(s);
  // A data sheet that states all but the axes as exact.
  for (const Parameter axis : {Parameter::kPanAxis0, Parameter::kTiltAxis1})
    options.data_sheet.covariance(index(axis), index(axis)) = 0.05 * 0.05;
  SelfCalibration calibration(options, nullptr);
  const auto before = feed(&calibration, s, {});
  ASSERT_FALSE(before.empty());
  const auto published = feed(&calibration, s, {FrameTracks::Tracker::kOe, {}, 20, false, 0, 1000});
  ASSERT_FALSE(published.empty());
  EXPECT_FALSE(published[0].calibration->calibrated);
  // As little is sure of it as of the data sheet's, and nothing is surer than it was.
  EXPECT_EQ(published[0].calibration->calibration.covariance,
            before.back().calibration->calibration.covariance + options.data_sheet.covariance);
  EXPECT_GT(parameter_sigma(published[0].calibration->calibration, Parameter::kFocalLength), 0);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kDoubtful);
  EXPECT_THAT(test::lines_of(calibration), Contains(HasSubstr("is withdrawn")));
  // And the camera, followed anew, is calibrated again.
  const auto again = feed(&calibration, s,
                          {FrameTracks::Tracker::kStartUp,
                           {},
                           40,
                           false,
                           std::numeric_limits<double>::infinity(),
                           2000});
  ASSERT_FALSE(again.empty());
  EXPECT_TRUE(again[0].calibration->calibrated);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
}

// Without automatic calibration nothing would take its place: it is said, once, and stays.
TEST(SelfCalibration, KeepsAContradictedCalibrationIfItIsNotAutomatic) {
  const test::Simulation s = camera();
  MemoryArchive archive;
  {
    SelfCalibration automatic(options_for(s), &archive);
    ASSERT_FALSE(feed(&automatic, s, {}).empty());
  }
  SelfCalibrationOptions options = options_for(s);
  options.automatic = false;
  SelfCalibration calibration(options, &archive);
  ASSERT_TRUE(calibration.first()->calibrated);
  const Calibration kept = calibration.first()->calibration;
  for (const double from_s : {0.0, 20.0}) {
    EXPECT_THAT(feed(&calibration, s, {FrameTracks::Tracker::kOe, {}, from_s, false, 0, 1000}),
                IsEmpty());
  }
  EXPECT_TRUE(calibration.first()->calibrated);
  EXPECT_EQ(calibration.first()->calibration.covariance, kept.covariance);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kOff);
  EXPECT_THAT(
      test::lines_of(calibration),
      Contains(AllOf(HasSubstr("stays in use"), HasSubstr("calibration.auto is false"))).Times(1));
}

// A file that landmarks contradict is not taken up with the next sample that tells its zoom.
TEST(SelfCalibration, DoesNotTakeUpAgainWhatItHasWithdrawn) {
  const test::Simulation s = camera();
  MemoryArchive archive;
  SelfCalibration calibration(options_for(s), &archive);
  Feed how;
  how.zoom = 100;
  ASSERT_FALSE(feed(&calibration, s, how).empty());
  ASSERT_NE(archive.find(100), nullptr);
  how.tracker = FrameTracks::Tracker::kOe;
  how.from_s = 20;
  how.first_frame = 1000;
  how.contradicting_from_s = 0;
  test::Simulation for_seconds = s;
  for_seconds.duration_s = 5;
  const auto published = feed(&calibration, for_seconds, how);
  ASSERT_EQ(published.size(), 1U);
  EXPECT_FALSE(published[0].calibration->calibrated);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kDoubtful);
  // At another zoom and back: it is still the same file.
  test::Simulation briefly = s;
  briefly.duration_s = 1;
  how.contradicting_from_s = std::numeric_limits<double>::infinity();
  for (const double zoom : {900.0, 100.0}) {
    how.zoom = zoom;
    how.from_s += 20;
    how.first_frame += 1000;
    EXPECT_THAT(feed(&calibration, briefly, how), IsEmpty()) << zoom;
  }
  // One that is made anew takes its place, and is taken up as any other.
  how.tracker = FrameTracks::Tracker::kStartUp;
  how.from_s += 20;
  how.first_frame += 1000;
  const auto again = feed(&calibration, s, how);
  ASSERT_FALSE(again.empty());
  EXPECT_TRUE(again.back().calibration->calibrated);
  archive.stored_.erase(archive.stored_.begin());
  test::Simulation narrow = s;
  narrow.focal_length = 8000;
  how.zoom = 900;
  how.from_s += 20;
  how.first_frame += 1000;
  ASSERT_FALSE(feed(&calibration, narrow, how).empty());
  how.zoom = 100;
  how.from_s += 20;
  how.first_frame += 1000;
  EXPECT_EQ(feed(&calibration, briefly, how).size(), 1U);
}

TEST(SelfCalibration, SaysThatPicturesAreRepeatedAndDoesNotBlameTelemetry) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  Feed how;
  how.converted = 0.6;
  EXPECT_THAT(feed(&calibration, s, how), IsEmpty());
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kFreshPictures);
  EXPECT_THAT(test::lines_of(calibration),
              ::testing::ElementsAre(AllOf(HasSubstr("pictures are repeated: up to 40 %"),
                                           Not(HasSubstr("positive")))));
}

// Landmarks that disagree with telemetry then tell of the video's times, not of the camera.
TEST(SelfCalibration, NeitherWithdrawsNorCalibratesWhileTheDelayWanders) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  static_cast<void>(test::lines_of(calibration));
  Feed how;
  how.tracker = FrameTracks::Tracker::kOe;
  how.from_s = 20;
  how.first_frame = 1000;
  how.contradicting_from_s = 0;
  how.delay_wander_s = 0.05;
  EXPECT_THAT(feed(&calibration, s, how), IsEmpty());
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kSteadyDelay);
  EXPECT_THAT(test::lines_of(calibration),
              ::testing::ElementsAre(AllOf(HasSubstr("wander by 50 ms"), HasSubstr("relay"))));
  // As soon as it holds again the offset to telemetry is found anew, as of a new connection.
  test::Simulation later = s;
  later.clock_offset += 0.004;
  later.duration_s = 16;
  how.from_s = 40;
  how.first_frame = 2000;
  how.contradicting_from_s = std::numeric_limits<double>::infinity();
  how.delay_wander_s = 0;
  const auto published = feed(&calibration, later, how);
  ASSERT_EQ(published.size(), 1U);
  expect_truth(later, published[0].calibration->calibration);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kNothing);
}

TEST(SelfCalibration, FindsTheClockOffsetOfANewConnection) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  test::Simulation reconnected = s;
  reconnected.clock_offset += 0.004;
  reconnected.duration_s = 16;
  const auto published = feed(
      &calibration, reconnected,
      {FrameTracks::Tracker::kOe, {}, 20, true, std::numeric_limits<double>::infinity(), 1000});
  ASSERT_EQ(published.size(), 1U);
  expect_truth(reconnected, published[0].calibration->calibration);
}

// As late as a slow device behind a fast camera: within what is searched, and kept from before the first frame.
TEST(SelfCalibration, FindsTelemetryThatComesLaterThanTheVideo) {
  test::Simulation s = camera();
  s.clock_offset = 0.4;
  SelfCalibration calibration(options_for(s), nullptr);
  const auto published = feed(&calibration, s, {});
  ASSERT_FALSE(published.empty());
  expect_truth(s, published.back().calibration->calibration);
}

TEST(SelfCalibration, SaysThatTelemetryComesTooLateAlsoWhereThereIsACalibration) {
  MemoryArchive archive;
  StoredCalibration stored;
  stored.calibration.camera = {5000, 1, {0}, 1920, 1080};
  archive.stored_.push_back(stored);
  SelfCalibration calibration(options_for(camera()), &archive);
  FrameTracks frame;
  const auto play = [&](int frames, bool too_old) {
    for (int i = 0; i < frames; ++i) {
      frame.stamp.receive_time_s += 0.05;
      frame.telemetry_too_old = too_old;
      calibration.add(frame);
      PanTiltSample sample;
      sample.latest_time_s = frame.stamp.receive_time_s;
      calibration.add(sample);
    }
  };
  play(40, false);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kNothing);
  play(40, true);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kYoungTelemetry);
  EXPECT_THAT(to_string(calibration.report().need), HasSubstr("realtime.max_extrapolation_s"));
  play(40, false);
  EXPECT_EQ(calibration.report().need, CalibrationNeed::kNothing);
}

// A video whose least delay steps has another clock offset from then on, as after a reconnection.
TEST(SelfCalibration, FindsTheClockOffsetAfterAStepOfTheDelay) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  test::Simulation later = s;
  later.clock_offset += 0.004;
  later.duration_s = 16;
  Feed how;
  how.tracker = FrameTracks::Tracker::kOe;
  how.from_s = 20;
  how.first_frame = 1000;
  how.delay_steps = true;
  const auto published = feed(&calibration, later, how);
  ASSERT_EQ(published.size(), 1U);
  expect_truth(later, published[0].calibration->calibration);
}

TEST(SelfCalibration, KeepsOneCalibrationForEachZoom) {
  const test::Simulation wide = camera();
  test::Simulation narrow = camera();
  narrow.focal_length = 8000;
  MemoryArchive archive;
  SelfCalibration calibration(options_for(wide), &archive);
  Feed how;
  how.zoom = 100;
  ASSERT_FALSE(feed(&calibration, wide, how).empty());
  how.zoom = 900;
  how.from_s = 20;
  how.first_frame = 1000;
  const auto at_900 = feed(&calibration, narrow, how);
  ASSERT_FALSE(at_900.empty());
  expect_truth(narrow, at_900.back().calibration->calibration);
  EXPECT_EQ(at_900.back().calibration->calibration.zoom, 900.0);
  // Back again: with the first sample, not after a new calibration.
  how.zoom = 100;
  how.from_s = 40;
  how.first_frame = 2000;
  const auto back = feed(&calibration, wide, how);
  ASSERT_FALSE(back.empty());
  EXPECT_LT(back[0].time_s, 0.4);
  EXPECT_EQ(back[0].calibration->calibration.zoom, 100.0);
  expect_truth(wide, back[0].calibration->calibration);
}

TEST(SelfCalibration, WhatIsStoredForAZoomMayBeOfAnotherConnection) {
  MemoryArchive archive;
  for (const double zoom : {100.0, 900.0}) {
    StoredCalibration stored;
    stored.calibration.camera = {20 * zoom, 1, {0}, 1920, 1080};
    stored.calibration.zoom = zoom;
    archive.stored_.push_back(stored);
  }
  SelfCalibration calibration(options_for(camera()), &archive);
  PanTiltSample sample;
  for (const double zoom : {100.0, 900.0}) {
    sample.zoom = zoom;
    std::shared_ptr<const PublishedCalibration> published;
    for (int i = 0; i < 50; ++i) {
      sample.latest_time_s += 0.04;
      calibration.add(sample);
      if (auto news = calibration.work()) published = news;
    }
    ASSERT_TRUE(published) << zoom;
    EXPECT_EQ(published->calibration.zoom, zoom);
    EXPECT_FALSE(published->of_this_connection);
  }
}

TEST(SelfCalibration, BeginsWithWhatIsStored) {
  MemoryArchive archive;
  StoredCalibration stored;
  stored.calibration.camera = {5000, 1, {0}, 1920, 1080};
  stored.path = "/somewhere/calibration.yaml";
  archive.stored_.push_back(stored);
  SelfCalibration calibration(options_for(camera()), &archive);
  EXPECT_TRUE(calibration.first()->calibrated);
  EXPECT_EQ(calibration.first()->calibration.camera.focal_length, 5000);
  EXPECT_EQ(calibration.first()->name, stored.path);
  EXPECT_EQ(calibration.report().activity, CalibrationActivity::kWatching);
}

TEST(SelfCalibration, KeepsWhatAFullDiskDoesNotTakeAndTriesAgain) {
  const test::Simulation s = camera();
  MemoryArchive archive;
  archive.full = true;
  SelfCalibration calibration(options_for(s), &archive);
  ASSERT_FALSE(feed(&calibration, s, {}).empty());
  EXPECT_THAT(test::lines_of(calibration),
              Contains(AllOf(HasSubstr("disk full"), HasSubstr("tried again"))));
  archive.full = false;
  PanTiltSample later;
  later.latest_time_s = 120;
  calibration.add(later);
  ASSERT_TRUE(calibration.due());
  static_cast<void>(calibration.work());
  EXPECT_EQ(archive.tries, 1);
  EXPECT_FALSE(archive.has_pending());
  EXPECT_THAT(test::lines_of(calibration), Contains("the calibration is stored now"));
}

TEST(SelfCalibration, CancelledItPublishesNothingMore) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  calibration.cancel();
  EXPECT_THAT(feed(&calibration, s, {}), IsEmpty());
  EXPECT_FALSE(calibration.due());
}

// A program that ends while it computes a calibration has failed at nothing.
TEST(SelfCalibration, CancelledWhileItAdjustsItDoesNotSayThatItFailed) {
  const test::Simulation s = camera();
  SelfCalibration calibration(options_for(s), nullptr);
  clockid_t own_clock{};
  ASSERT_EQ(::pthread_getcpuclockid(::pthread_self(), &own_clock), 0);
  const auto computed_s = [own_clock] {
    timespec time{};
    ::clock_gettime(own_clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  std::thread cancelling;
  Feed how;
  how.before_adjusting = [&] {
    if (cancelling.joinable()) return;
    // It takes a hundred times as long.
    cancelling = std::thread([&, until_s = computed_s() + 1e-3] {
      while (computed_s() < until_s) std::this_thread::yield();
      calibration.cancel();
    });
  };
  feed(&calibration, s, how);
  ASSERT_TRUE(cancelling.joinable());
  cancelling.join();
  EXPECT_THAT(test::lines_of(calibration), Each(Not(HasSubstr("cancelled"))));
}

TEST(SelfCalibration, TakesKeyframesWhereItHasNone) {
  const test::Simulation s = camera();
  SelfCalibrationOptions options = options_for(s);
  options.session.max_keyframes = 3;
  SelfCalibration calibration(options, nullptr);
  EXPECT_FALSE(calibration.wants_keyframe()) << "no frame to take one of";
  PanTiltSample sample;
  FrameTracks tracks;
  tracks.tracker = FrameTracks::Tracker::kStartUp;
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(s.width * s.height), 128);
  const ImageView image{pixels.data(), s.width, s.height, s.width};
  for (int i = 0; i < 6; ++i) {
    sample.pan_rad = i;  // far apart, with a field of view of half a radian
    calibration.add(sample);
    tracks.stamp.frame = i;
    tracks.time_is_of_use = true;
    calibration.add(tracks);
    EXPECT_TRUE(calibration.wants_keyframe()) << i;
    // A frame that is of no use to the session was lent its image all the same.
    tracks.stamp.frame = 100 + i;
    tracks.time_is_of_use = false;
    calibration.add(tracks);
    calibration.add_keyframe(tracks.stamp.frame, image);
    EXPECT_TRUE(calibration.wants_keyframe()) << "an image of another frame is not this one's";
    calibration.add_keyframe(i, image);
    EXPECT_FALSE(calibration.wants_keyframe()) << "one of this view is enough";
  }
}

}  // namespace
}  // namespace alidade

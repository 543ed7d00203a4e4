// Signs, focal length and clock offset from motion: seen where there is evidence, and only there.

#include "edge_app/check/motion_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/angle.h"
#include "test/edge_app/check/findings.h"
#include "test/support/not_a_number.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr double kFocalLength = 2000;  // px
constexpr double kOffset = -0.12;      // s

// Moves with changing speed on both axes.
Vector2<double> wander(double t) {
  return {0.2 * std::sin(0.9 * t) + 0.05 * std::sin(2.3 * t + 1), 0.1 * std::sin(1.1 * t + 0.5)};
}

// The image and the head of 10 s of a path, the true angles at image time t; the head's clock is kOffset ahead.
struct Scene {
  std::vector<TimedShift> shifts;
  std::vector<PanTiltSample> samples;
  MotionNeeds needs;

  template <typename Path>
  explicit Scene(const Path& path, const Vector2<double>& signs = {1, 1}, double start = 0,
                 double offset = kOffset) {
    std::mt19937 random(2);
    std::normal_distribution<double> noise(0, 0.1);
    for (int i = 0; i < 250; ++i) {
      const double from = 0.04 * i;
      const double to = 0.04 * (i + 1);
      const Vector2<double> a = path(from);
      const Vector2<double> b = path(to);
      const double pan_px = -kFocalLength * std::cos(0.5 * (a[1] + b[1])) * (b[0] - a[0]);
      shifts.push_back(
          {from, to, {pan_px + noise(random), kFocalLength * (b[1] - a[1]) + noise(random)}});
    }
    for (int i = -30; i < 330; ++i) {
      PanTiltSample sample;
      sample.earliest_time_s = sample.latest_time_s = i / 30.0 + offset;
      const Vector2<double> angle = path(i / 30.0).cwiseProduct(signs);
      sample.pan_rad = wrap_angle(start + angle[0]);
      sample.tilt_rad = wrap_angle(angle[1]);
      samples.push_back(sample);
    }
    needs.source = "http://head";
    needs.video = "rtsp://camera";
    needs.image_width_px = 640;
    needs.focal_length_px = kFocalLength;
    needs.focal_length_from = "camera.focal_length_px";
    needs.reverse_pan = "REVERSE PAN";
    needs.reverse_tilt = "REVERSE TILT";
    needs.turn_image = "TURN";
  }

  [[nodiscard]] MotionReport check() const { return check_measured_motion(shifts, samples, needs); }
};

TEST(MotionCheck, FindsSignsFocalLengthAndOffset) {
  const MotionReport report = Scene(wander).check();
  EXPECT_EQ(report.pan, AxisVerdict::kRight);
  EXPECT_EQ(report.tilt, AxisVerdict::kRight);
  EXPECT_NEAR(*report.focal_length_px, kFocalLength, 0.02 * kFocalLength);
  EXPECT_NEAR(*report.clock_offset_s, kOffset, 0.011);
  EXPECT_THAT(report.findings, IsEmpty());
}

TEST(MotionCheck, FindsThemWhereVideoIsLateBySeconds) {
  for (const double offset : {-3.1, -1.74, -1.2, -1.0, 1.01, 2.2}) {
    const MotionReport report = Scene(wander, {1, 1}, 0, offset).check();
    EXPECT_EQ(report.pan, AxisVerdict::kRight) << offset;
    EXPECT_EQ(report.tilt, AxisVerdict::kRight) << offset;
    EXPECT_NEAR(report.focal_length_px.value_or(0), kFocalLength, 0.02 * kFocalLength) << offset;
    EXPECT_NEAR(report.clock_offset_s.value_or(0), offset, 0.011) << offset;
    EXPECT_THAT(report.findings, IsEmpty()) << offset;
  }
}

// Later than the video is long: whatever fits then fits by chance.
TEST(MotionCheck, ClaimsNothingWhereTheOffsetCannotBeFound) {
  for (const double offset : {-9.0, -7.5, -6.0, 6.0, 7.5, 9.0, 40.0}) {
    for (const double phase : {0.0, 1.0, 2.0, 3.0}) {
      const auto later = [&](double t) { return wander(t + phase); };
      const MotionReport report = Scene(later, {1, 1}, 0, offset).check();
      EXPECT_NE(report.pan, AxisVerdict::kReversed) << offset << " " << phase;
      EXPECT_NE(report.tilt, AxisVerdict::kReversed) << offset << " " << phase;
      EXPECT_THAT(report.findings, IsEmpty()) << offset << " " << phase;
    }
  }
}

TEST(MotionCheck, FindsThemAcrossHalfATurn) {
  const MotionReport report = Scene(wander, {1, 1}, kPi).check();
  EXPECT_EQ(report.pan, AxisVerdict::kRight);
  EXPECT_NEAR(*report.focal_length_px, kFocalLength, 0.02 * kFocalLength);
}

TEST(MotionCheck, SaysWhichAxisIsReversedAndWhatToSet) {
  const MotionReport pan = Scene(wander, {-1, 1}).check();
  EXPECT_EQ(pan.pan, AxisVerdict::kReversed);
  EXPECT_EQ(pan.tilt, AxisVerdict::kRight);
  EXPECT_THAT(problems(pan.findings), ElementsAre(HasSubstr("pan is reversed")));
  EXPECT_THAT(problems(pan.findings), ElementsAre(HasSubstr("REVERSE PAN")));
  const MotionReport tilt = Scene(wander, {1, -1}).check();
  EXPECT_EQ(tilt.pan, AxisVerdict::kRight);
  EXPECT_EQ(tilt.tilt, AxisVerdict::kReversed);
  EXPECT_THAT(problems(tilt.findings), ElementsAre(HasSubstr("REVERSE TILT")));
  EXPECT_THAT(problems(Scene(wander, {-1, -1}).check().findings), ElementsAre(HasSubstr("TURN")));
}

TEST(MotionCheck, FindsAImageTurnedByAQuarter) {
  Scene scene(wander);
  for (TimedShift& shift : scene.shifts) shift.shift = {shift.shift[1], -shift.shift[0]};
  const MotionReport report = scene.check();
  EXPECT_TRUE(report.quarter_turn);
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("turned by 90 degrees")));
}

TEST(MotionCheck, SaysHowFarTheFocalLengthIsOff) {
  Scene scene(wander);
  scene.needs.focal_length_px = 1.15 * kFocalLength;  // a data sheet's
  EXPECT_THAT(scene.check().findings, IsEmpty());
  scene.needs.focal_length_px = 4 * kFocalLength;
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("0.25 times the 8000 px")));
  scene.needs.focal_length_px = 1.15 * kFocalLength;
  scene.needs.calibrated = true;
  scene.needs.clock_offset_s = kOffset;
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("Calibrate again")));
}

// A zoom without a calibration may be at any place of its range, and each place is right.
TEST(MotionCheck, TakesAnyFocalLengthOfAZoomsRange) {
  Scene scene(wander);
  scene.needs.focal_length_px = 0.5 * kFocalLength;
  scene.needs.tele_px = 20 * kFocalLength;
  EXPECT_THAT(scene.check().findings, IsEmpty());
  scene.needs.tele_px = 0.6 * kFocalLength;
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("but 1000 to 1200 px are")));
  scene.needs.focal_length_px = 2 * kFocalLength;
  scene.needs.tele_px = 20 * kFocalLength;
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("but 4000 to 40000 px are")));
}

// As with a wrong range of a head that tells -1 to 1.
TEST(MotionCheck, NamesAnAxisWhoseAnglesHaveAnotherScale) {
  for (const double factor : {1.06, 0.9, 2.0}) {
    for (const int axis : {0, 1}) {
      Scene scene(wander, {1, 1}, 0.7);
      scene.needs.scales = "SCALES";
      for (PanTiltSample& sample : scene.samples) {
        double& angle = axis == 0 ? sample.pan_rad : sample.tilt_rad;
        angle *= factor;
      }
      const MotionReport report = scene.check();
      ASSERT_TRUE(report.by_axis) << factor;
      const auto& wrong = (*report.by_axis)[static_cast<std::size_t>(axis)];
      EXPECT_NEAR(wrong.value_px, kFocalLength / factor, 0.01 * kFocalLength / factor);
      const bool is_pan_large = (factor > 1) == (axis == 0);
      EXPECT_THAT(problems(scene.check().findings),
                  ::testing::Contains(
                      AllOf(HasSubstr("pan and tilt differ in scale"), HasSubstr("SCALES"),
                            HasSubstr(is_pan_large ? "either pan's angles are too large"
                                                   : "either tilt's angles are too large"))))
          << factor << " " << axis;
    }
  }
  Scene alike(wander);
  for (PanTiltSample& sample : alike.samples) sample.pan_rad *= 1.02;
  EXPECT_THAT(alike.check().findings, IsEmpty());
}

TEST(MotionCheck, AdvisesWhereTheClockOffsetIsAnother) {
  Scene scene(wander);
  scene.needs.calibrated = true;
  scene.needs.clock_offset_s = kOffset + 0.04;
  EXPECT_THAT(scene.check().findings, IsEmpty());
  scene.needs.clock_offset_s = kOffset + 0.3;
  EXPECT_THAT(advice(scene.check().findings), ElementsAre(HasSubstr("calibrate again")));
}

TEST(MotionCheck, TellsOneAxisIfOnlyOneMoves) {
  const MotionReport report =
      Scene([](double t) { return Vector2<double>(wander(t)[0], 0.1); }, {-1, 1}).check();
  EXPECT_EQ(report.pan, AxisVerdict::kReversed);
  EXPECT_EQ(report.tilt, AxisVerdict::kNotMoved);
}

TEST(MotionCheck, TellsNothingOfAnEvenSwing) {
  // Half a period of 1.2 s lies within the offsets searched: right and reversed fit alike.
  const MotionReport report =
      Scene([](double t) { return Vector2<double>(0.1 * std::sin(2 * kPi / 1.2 * t), 0); }).check();
  EXPECT_EQ(report.pan, AxisVerdict::kUnclear);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_THAT(describe(report).front().second, HasSubstr("at changing speed"));
}

TEST(MotionCheck, TellsNothingOfAImageThatGoesItsOwnWay) {
  Scene scene(wander);
  std::mt19937 random(5);
  std::normal_distribution<double> jump(0, 20);
  for (TimedShift& shift : scene.shifts) shift.shift = {jump(random), jump(random)};
  const MotionReport report = scene.check();
  EXPECT_EQ(report.pan, AxisVerdict::kUnclear);
  EXPECT_EQ(report.tilt, AxisVerdict::kUnclear);
  EXPECT_THAT(report.findings, IsEmpty());
}

// Whatever the image seems to show: the right signs, one reversed, upside down, turned by 90
// degrees.
TEST(MotionCheck, TellsNoSignsWithoutTimes) {
  std::vector<Scene> scenes = {Scene(wander), Scene(wander, {1, -1}), Scene(wander, {-1, -1}),
                               Scene(wander)};
  for (TimedShift& shift : scenes.back().shifts) shift.shift = {shift.shift[1], -shift.shift[0]};
  for (Scene& scene : scenes) {
    scene.needs.not_judged = "the camera's time stamps count pictures";
    scene.needs.focal_length_px = 2 * kFocalLength;
    scene.needs.calibrated = true;
    const MotionReport report = scene.check();
    EXPECT_EQ(report.pan, AxisVerdict::kNotJudged);
    EXPECT_EQ(report.tilt, AxisVerdict::kNotJudged);
    EXPECT_FALSE(report.focal_length_px);
    EXPECT_FALSE(report.clock_offset_s);
    EXPECT_THAT(report.findings, IsEmpty());
    EXPECT_THAT(describe(report),
                ElementsAre(Pair("motion",
                                 "signs are not judged: the camera's time stamps count "
                                 "pictures")));
  }
}

TEST(MotionCheck, NoticesAHeadThatReportsOneAngleWithoutTimes) {
  Scene scene(wander, {0, 0});
  scene.needs.not_judged = "the camera's time stamps are not times";
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("the angles never change")));
}

TEST(MotionCheck, AsksToMoveACameraAtRest) {
  const MotionReport report = Scene([](double) { return Vector2<double>(0.3, 0.1); }).check();
  EXPECT_EQ(report.pan, AxisVerdict::kNotMoved);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_THAT(describe(report).front().second,
              AllOf(HasSubstr("for 2.4 s or more during the check"),
                    HasSubstr("by 2 px or more in 0.3 s")));
}

TEST(MotionCheck, NoticesAHeadThatReportsOneAngleForEver) {
  Scene scene(wander);
  for (PanTiltSample& sample : scene.samples) sample.pan_rad = sample.tilt_rad = 0.1;
  EXPECT_THAT(problems(scene.check().findings), ElementsAre(HasSubstr("the angles never change")));
}

TEST(MotionCheck, NoticesAImageThatStandsStill) {
  Scene scene(wander);
  for (TimedShift& shift : scene.shifts) shift.shift.setZero();
  EXPECT_THAT(problems(scene.check().findings),
              ElementsAre(HasSubstr("the picture does not move")));
}

TEST(MotionCheck, BearsHardlyAnythingAndNonsense) {
  EXPECT_THAT(check_measured_motion({}, {}, MotionNeeds()).findings, IsEmpty());
  const Scene scene(wander);
  EXPECT_THAT(check_measured_motion(scene.shifts, {}, scene.needs).findings, IsEmpty());
  EXPECT_THAT(check_measured_motion({}, scene.samples, scene.needs).findings, IsEmpty());
  EXPECT_THAT(check_measured_motion({scene.shifts[0]}, {scene.samples[0]}, scene.needs).findings,
              IsEmpty());
  Scene spoilt(wander);
  for (std::size_t i = 0; i < 250; i += 50) {
    spoilt.shifts[i].shift[0] = kNan;
    spoilt.samples[i].tilt_rad = kNan;
    spoilt.samples[i + 1].latest_time_s = -1e9;
  }
  EXPECT_EQ(spoilt.check().pan, AxisVerdict::kRight);
}

}  // namespace
}  // namespace alidade

// What a localized picture says of telemetry's base: how far it is off, and when that is a movement.

#include "edge_app/localization/base_judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/rotation.h"

namespace alidade {
namespace {

using Verdict = BaseJudge::Verdict;

constexpr double kRecordSigma = 1e-4;  // rad
constexpr double kMapSigma = 3e-5;
constexpr double kReferenceRow = 100;

// A record that looks there at row 0, while the camera turns.
OrientationRecord record_at(const PanTilt<double>& angle) {
  FrameOrientation frame;
  Calibration calibration;
  calibration.camera = {1500, 1, {0}, 640, 360};
  calibration.line_delay = 2e-5;
  calibration.mechanics.tilt_axis = Vector3<double>(0.01, 1, 0.02).normalized();
  MotionCovariance covariance = MotionCovariance::Zero();
  covariance.topLeftCorner<2, 2>() = kRecordSigma * kRecordSigma * Matrix2<double>::Identity();
  EXPECT_TRUE(make_frame_orientation(calibration, 5, OrientationMode::kOe, 50,
                                     {angle, {0.5, -0.25}, 0}, covariance, Sensitivity<6>::Zero(),
                                     &frame));
  OrientationRecord record;
  record.frame = 9;
  record.time_s = 5;
  record.mode = RecordMode::kOe;
  record.calibrated = true;
  record.orientation = orientation_of(frame);
  record.camera = pack(calibration);
  return record;
}

// Of that frame, where the base lies so that telemetry's angles lack `zero`.
Localization localized(const PanTilt<double>& angle, const Vector2<double>& zero) {
  const Calibration calibration = unpack(record_at(angle).camera);
  const double t = kReferenceRow * calibration.line_delay;
  Localization found;
  found.status = LocalizationStatus::kOk;
  found.pose.R_base_from_camera = R_base_from_camera(
      calibration.mechanics,
      PanTilt<double>{angle.pan + 0.5 * t + zero.x(), angle.tilt - 0.25 * t + zero.y()});
  found.pose.covariance = kMapSigma * kMapSigma * Matrix4<double>::Identity();
  return found;
}

// The same record in the map's base. zero, sigma: telemetry's zero there, and how well it is known.
OrientationRecord tied(OrientationRecord record, const PanTilt<double>& zero, double sigma) {
  record.localized = OrientationRecord::Localized{1, 1e-5, zero, {sigma * sigma, 0, sigma * sigma}};
  return record;
}

// The same record while the link's delay is open.
OrientationRecord vague(OrientationRecord record) {
  constexpr double kSigma = 5e-3;
  for (double& value : record.orientation->covariance_rad2)
    value *= kSigma * kSigma / (kRecordSigma * kRecordSigma);
  return record;
}

struct Judged {
  Verdict verdict;
  ToldBase told;
  BaseOffset offset;
};
Judged judge(BaseJudge* judge, const OrientationRecord& record, const Localization& found) {
  Judged out;
  out.verdict = judge->judge(record, found, kReferenceRow, &out.told, &out.offset);
  return out;
}

TEST(BaseJudge, TellsTheChangeAtTheRowOfTheMapsPose) {
  BaseJudge some;
  const PanTilt<double> angle{3.1, 0.4};
  const Judged out = judge(&some, record_at(angle), localized(angle, {1e-3, -5e-4}));
  EXPECT_EQ(out.verdict, Verdict::kExpected);
  EXPECT_NEAR(out.told.change_rad[0], 1e-3, 1e-9);
  EXPECT_NEAR(out.told.change_rad[1], -5e-4, 1e-9);
  EXPECT_FALSE(out.told.moved);
  // All three axes of the camera are known alike, and so is the one that it pans about.
  EXPECT_NEAR(std::sqrt(out.told.covariance[0]), kMapSigma, 0.05 * kMapSigma);
  EXPECT_NEAR(std::sqrt(out.told.covariance[2]), kMapSigma, 0.05 * kMapSigma);
  EXPECT_NEAR(out.offset.zero.pan, 1e-3, 1e-9);
  EXPECT_NEAR(out.offset.roll, 0, 1e-9);
}

TEST(BaseJudge, AMovementTakesTwoPicturesThatSayTheSame) {
  BaseJudge some;
  const PanTilt<double> angle{0.2, -0.1};
  EXPECT_EQ(judge(&some, record_at(angle), localized(angle, {9e-3, 0})).verdict,
            Verdict::kSuspected);
  // A picture that was taken for another is not confirmed by the next one.
  EXPECT_EQ(judge(&some, record_at(angle), localized(angle, {0, -9e-3})).verdict,
            Verdict::kSuspected);
  const Judged out = judge(&some, record_at({0.3, 0}), localized({0.3, 0}, {1e-4, -9e-3}));
  EXPECT_EQ(out.verdict, Verdict::kMoved);
  EXPECT_TRUE(out.told.moved);
  EXPECT_NEAR(out.offset.zero.tilt, -9e-3, 1e-9);
}

TEST(BaseJudge, WhatIsTiedIsHeldAgainstWhatItClaims) {
  BaseJudge some;
  const PanTilt<double> angle{0.2, -0.1};
  const OrientationRecord record = tied(record_at(angle), {5e-3, 0}, 2e-3);
  const Judged out = judge(&some, record, localized(angle, {2e-4, 0}));
  EXPECT_EQ(out.verdict, Verdict::kExpected);
  EXPECT_NEAR(out.offset.zero.pan, 5.2e-3, 1e-9);
  EXPECT_EQ(judge(&some, record, localized(angle, {1e-3, 0})).verdict, Verdict::kSuspected);
}

// The first picture ties a vague record, which from then on agrees with the map, wherever the zero is.
TEST(BaseJudge, AZeroThatWasTiedBeforeItWasKnownIsAMovementOnceItIsKnown) {
  BaseJudge some;
  const PanTilt<double> angle{0.2, -0.1};
  const Localization found = localized(angle, {9e-3, 0});
  EXPECT_EQ(judge(&some, vague(record_at(angle)), found).verdict, Verdict::kExpected);
  const Localization agrees = localized(angle, {0, 0});
  const auto later = [&](double zero, double sigma) {
    return judge(&some, tied(record_at(angle), {zero, 0}, sigma), agrees);
  };
  EXPECT_EQ(later(9e-3, 5e-3).verdict, Verdict::kExpected) << "known no better than that";
  EXPECT_EQ(later(9e-3, 2e-4).verdict, Verdict::kSuspected);
  const Judged out = later(9.1e-3, 2e-4);
  EXPECT_EQ(out.verdict, Verdict::kMoved);
  EXPECT_NEAR(out.offset.zero.pan, 9.1e-3, 1e-9);
  EXPECT_NEAR(std::sqrt(out.offset.covariance(0, 0)), std::hypot(2e-4, kRecordSigma, kMapSigma),
              2e-6);
  EXPECT_EQ(later(9.1e-3, 1e-4).verdict, Verdict::kExpected) << "told once";
  // Untied again, as after a new calibration: still the same movement.
  EXPECT_EQ(judge(&some, record_at(angle), found).verdict, Verdict::kExpected);
}

TEST(BaseJudge, AVagueRecordIsNotTiedAtOnceWhereMovementsAreOnlyReported) {
  BaseJudge some({1e-3, false});
  const PanTilt<double> angle{0.2, -0.1};
  OrientationRecord record = vague(record_at(angle));
  EXPECT_EQ(judge(&some, record, localized(angle, {9e-3, 0})).verdict, Verdict::kVague);
  EXPECT_EQ(judge(&some, record_at(angle), localized(angle, {0, 0})).verdict, Verdict::kExpected);
  EXPECT_EQ(judge(&some, record, localized(angle, {9e-3, 0})).verdict, Verdict::kVague);
  *record.time_s += 59;
  EXPECT_EQ(judge(&some, record, localized(angle, {9e-3, 0})).verdict, Verdict::kVague);
  *record.time_s += 2;
  EXPECT_EQ(judge(&some, record, localized(angle, {9e-3, 0})).verdict, Verdict::kExpected);
}

TEST(BaseJudge, IsToldToReportOnly) {
  BaseJudge some({1e-3, false});
  const PanTilt<double> angle{0.2, -0.1};
  for (const Verdict expected : {Verdict::kSuspected, Verdict::kReported, Verdict::kReported}) {
    const Judged out = judge(&some, record_at(angle), localized(angle, {9e-3, 0}));
    EXPECT_EQ(out.verdict, expected);
    EXPECT_FALSE(out.told.moved);
  }
  EXPECT_EQ(judge(&some, record_at(angle), localized(angle, {0, 0})).verdict, Verdict::kExpected);
}

TEST(BaseJudge, TellsTheRollOfABaseThatHasTilted) {
  BaseJudge some;
  const PanTilt<double> angle{0, 0};
  Localization found = localized(angle, {0, 0});
  found.pose.R_base_from_camera =
      found.pose.R_base_from_camera * exp_so3(Vector3<double>(0, 0, 4e-3));
  const Judged out = judge(&some, record_at(angle), found);
  EXPECT_EQ(out.verdict, Verdict::kExpected) << "angles make up for none of it";
  EXPECT_NEAR(out.offset.roll, 4e-3, 1e-4);
  EXPECT_NEAR(out.told.change_rad[0], 0, 1e-4);
}

// Changes drawn from what record and map claim, and from the zero's own sigma: false movements are rare.
TEST(BaseJudge, CallsNothingAMovementThatIsWithinItsSigmas) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  BaseJudge some;
  int suspected = 0;
  constexpr int kPictures = 2000;
  for (int i = 0; i < kPictures; ++i) {
    const PanTilt<double> angle{0.001 * i - 1, 0.3 * std::sin(0.01 * i)};
    const double sigma = std::hypot(1e-3, std::hypot(kRecordSigma, kMapSigma));
    const double pan = sigma * normal(random);
    const Judged out =
        judge(&some, record_at(angle), localized(angle, {pan, sigma * normal(random)}));
    suspected += out.verdict == Verdict::kExpected ? 0 : 1;
  }
  // One in 3e5 is expected beyond a chi-square of 25.
  EXPECT_LE(suspected, 1);
}

}  // namespace
}  // namespace alidade

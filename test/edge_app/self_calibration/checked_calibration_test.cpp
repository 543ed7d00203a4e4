// A session's calibration is tried on the frames that it did not use: what they say reaches its sigmas, or refuses it.

#include "edge_app/self_calibration/checked_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using ::testing::Contains;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Lt;
using ::testing::Optional;

// held_out_factor: of the sigmas that the tracker states in the frames that are held out; 0: it
// finds nothing there.
// polled_width_s: of the interval in which each angle was asked for; 0: numbered by the device.
// measured_every: polls; between them the device repeats its angle.
CalibrationSession session_of(const test::Simulation& s, double held_out_factor,
                              double polled_width_s = 0, std::size_t measured_every = 1) {
  CalibrationInput input = test::simulate(s);
  for (std::size_t i = 0; i < input.telemetry.size(); ++i) {
    const CalibrationTelemetry& measured = input.telemetry[i - i % measured_every];
    input.telemetry[i].pan_rad = measured.pan_rad;
    input.telemetry[i].tilt_rad = measured.tilt_rad;
  }
  CalibrationSession session{SessionLimits()};
  for (const CalibrationTelemetry& from : input.telemetry) {
    PanTiltSample sample;
    sample.earliest_time_s = from.stamp_s - polled_width_s / 2;
    sample.latest_time_s = from.stamp_s + polled_width_s / 2;
    sample.pan_rad = from.pan_rad;
    sample.tilt_rad = from.tilt_rad;
    if (polled_width_s == 0) sample.sequence = from.sequence;
    session.add(sample);
  }
  std::map<std::int64_t, std::vector<TrackedPoint>> points;
  for (const CalibrationObservation& seen : input.observations) {
    points[seen.frame].push_back({static_cast<std::uint32_t>(seen.landmark),
                                  static_cast<float>(seen.u_px), static_cast<float>(seen.v_px),
                                  static_cast<float>(seen.sigma_px)});
  }
  std::size_t place = 0;
  for (const CalibrationFrame& frame : input.frames) {
    FrameTracks tracks;
    tracks.stamp.frame = frame.frame;
    tracks.stamp.receive_time_s = frame.stamp_s;
    tracks.stamp.sequence = frame.sequence;
    const bool held_out = CalibrationSession::is_held_out(place++);
    for (TrackedPoint point : points[frame.frame]) {
      if (tracks.count == kMaxFramePoints || (held_out && held_out_factor == 0)) break;
      if (held_out) point.sigma_px *= static_cast<float>(held_out_factor);
      tracks.points[static_cast<std::size_t>(tracks.count++)] = point;
    }
    session.add(tracks);
  }
  return session;
}

CheckedCalibrationOptions session_options(const test::Simulation& s) {
  CheckedCalibrationOptions options;
  options.width = s.width;
  options.height = s.height;
  options.noise.pan_tilt_sigma_rad = s.pan_tilt_sigma;
  return options;
}

CheckedCalibration calibrated(double held_out_factor, const Calibration* known = nullptr) {
  const test::Simulation s = test::arrival_stamped_camera();
  const CalibrationSession session = session_of(s, held_out_factor);
  if (known == nullptr) return calibrate_session(session, session_options(s), nullptr);
  const KnownCalibration prior{*known, true};
  return calibrate_session(session, session_options(s), &prior);
}

double excess_of(const CheckedCalibration& checked) {
  const double unit = std::max(1.0, checked.result.quality.pixel_sigma_ratio);
  return std::max(1.0, checked.hold_out.value_or(0) / unit);
}

TEST(CheckedCalibration, TellsWhatOfTheTelemetryWasLeftOut) {
  const test::Simulation s = test::arrival_stamped_camera();
  const CalibrationSession session = session_of(s, 1, 2e-3, 3);
  EXPECT_THAT(calibrate_session(session, session_options(s), nullptr).remarks,
              Contains(HasSubstr("of telemetry repeat an old angle")));
}

// The sigmas of frames that the adjustment does not see cannot change it: only what these frames say does.
TEST(CheckedCalibration, SigmasGrowAsMuchAsHeldOutFramesLieFartherOffThanTheyClaim) {
  const CheckedCalibration honest = calibrated(1);
  const CheckedCalibration off = calibrated(0.6);
  ASSERT_THAT(honest.refusal, IsEmpty());
  ASSERT_THAT(off.refusal, IsEmpty());
  ASSERT_EQ(off.result.calibration.camera.focal_length,
            honest.result.calibration.camera.focal_length);
  ASSERT_GT(excess_of(off), 1.2);
  const double ratio = excess_of(off) / excess_of(honest);
  for (int i = 0; i < kParameterCount; ++i) {
    const double sigma = std::sqrt(honest.result.calibration.covariance(i, i));
    EXPECT_NEAR(std::sqrt(off.result.calibration.covariance(i, i)), ratio * sigma, 1e-9 * sigma)
        << to_string(static_cast<Parameter>(i));
  }
}

TEST(CheckedCalibration, SigmasDoNotShrinkWhereHeldOutFramesFitBetterThanTheyClaim) {
  const CheckedCalibration honest = calibrated(1);
  const CheckedCalibration modest = calibrated(3);
  ASSERT_THAT(modest.hold_out, Optional(Lt(0.5)));
  EXPECT_LE(modest.result.calibration.covariance(0, 0), honest.result.calibration.covariance(0, 0));
  EXPECT_NEAR(modest.result.calibration.covariance(0, 0) * excess_of(honest) * excess_of(honest),
              honest.result.calibration.covariance(0, 0),
              1e-9 * honest.result.calibration.covariance(0, 0));
}

TEST(CheckedCalibration, IsRefusedWhereHeldOutFramesContradictIt) {
  const CheckedCalibration off = calibrated(0.2);
  EXPECT_TRUE(off.result.ok());
  EXPECT_THAT(off.hold_out, Optional(Gt(2)));
  EXPECT_THAT(off.refusal, HasSubstr("held out"));
}

TEST(CheckedCalibration, IsRefusedWhereNothingWasSeenInHeldOutFrames) {
  const CheckedCalibration untold = calibrated(0);
  EXPECT_TRUE(untold.result.ok());
  EXPECT_EQ(untold.hold_out, std::nullopt);
  EXPECT_THAT(untold.refusal, HasSubstr("held out"));
}

TEST(CheckedCalibration, WhatIsKnownMakesItSharper) {
  const CheckedCalibration first = calibrated(1);
  const CheckedCalibration refined = calibrated(1, &first.result.calibration);
  ASSERT_THAT(refined.refusal, IsEmpty());
  const int f = index(Parameter::kFocalLength);
  EXPECT_LT(refined.result.calibration.covariance(f, f), first.result.calibration.covariance(f, f));
}

TEST(CheckedCalibration, WhatIsKnownKeepsItsFreeCentre) {
  const test::Simulation s = test::arrival_stamped_camera();
  const CalibrationSession session = session_of(s, 1);
  CheckedCalibrationOptions options = session_options(s);
  options.adjustment.centre_sigma_px = 19;
  const Calibration first = calibrate_session(session, options, nullptr).result.calibration;
  const KnownCalibration known{first, true};
  const CheckedCalibration refined = calibrate_session(session, options, &known);
  ASSERT_THAT(refined.refusal, IsEmpty());
  const Calibration& c = refined.result.calibration;
  EXPECT_EQ(c.camera.centre_u, first.camera.centre_u);
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    EXPECT_NEAR(parameter_sigma(c, p), parameter_sigma(first, p), 1e-9);
  }
  EXPECT_LT(parameter_sigma(c, Parameter::kFocalLength),
            parameter_sigma(first, Parameter::kFocalLength));
  // The axes follow the centre as before.
  const int axis = index(Parameter::kPanAxis0);
  const int centre = index(Parameter::kCentreU);
  EXPECT_NEAR(c.covariance(axis, centre), first.covariance(axis, centre),
              0.02 * std::abs(first.covariance(axis, centre)));
}

TEST(CheckedCalibration, TakesWhatIsKnownOfTheCameraBeforehandOnceAndSaysWhatContradicts) {
  const test::Simulation s = test::arrival_stamped_camera();
  const CalibrationSession session = session_of(s, 1);
  CheckedCalibrationOptions options = session_options(s);
  const CheckedCalibration alone = calibrate_session(session, options, nullptr);
  ASSERT_THAT(alone.refusal, IsEmpty());
  const double sigma = std::sqrt(alone.result.calibration.covariance(index(Parameter::kLineDelay),
                                                                     index(Parameter::kLineDelay)));
  options.camera.name = "lens.yaml";
  options.camera.line_delay = {{s.line_delay, 0.1 * sigma}, true};
  const auto sigma_of = [](const CheckedCalibration& c) {
    return std::sqrt(c.result.calibration.covariance(index(Parameter::kLineDelay),
                                                     index(Parameter::kLineDelay)));
  };
  const CheckedCalibration sharp = calibrate_session(session, options, nullptr);
  EXPECT_THAT(sharp.remarks, IsEmpty());
  EXPECT_LT(sigma_of(sharp), 0.15 * sigma);
  // What is published holds it already.
  const KnownCalibration published{alone.result.calibration, true};
  EXPECT_GT(sigma_of(calibrate_session(session, options, &published)), 0.5 * sigma);
  options.camera.line_delay.prior.value += 20 * sigma;
  const CheckedCalibration contradicted = calibrate_session(session, options, nullptr);
  EXPECT_THAT(contradicted.remarks,
              ::testing::ElementsAre(HasSubstr("lens.yaml: line delay contradicts")));
  EXPECT_EQ(contradicted.result.calibration.line_delay, alone.result.calibration.line_delay);
}

// The known offset errs by it as much as the new data do, and so says the more of the rest.
TEST(CheckedCalibration, WhatAllPollsHaveInCommonDoesNotWeakenAKnownClockOffset) {
  constexpr double kWidth_s = 0.02;
  const test::Simulation s = test::arrival_stamped_camera();
  const CalibrationSession session = session_of(s, 1, kWidth_s);
  const int d = index(Parameter::kClockOffset);
  Calibration known = calibrate_session(session, session_options(s), nullptr).result.calibration;
  known.covariance(d, d) = kWidth_s * kWidth_s / 12;  // no more than what is common
  const auto refined = [&](double moved_s) {
    Calibration moved = known;
    moved.clock_offset += moved_s;
    const KnownCalibration prior{moved, true};
    return calibrate_session(session, session_options(s), &prior);
  };
  constexpr double kMoved_s = 1e-3;
  const CheckedCalibration later = refined(kMoved_s);
  const double share =
      (later.result.calibration.clock_offset - refined(-kMoved_s).result.calibration.clock_offset) /
      (2 * kMoved_s);
  // Of the known offset a fifth of the sigma is taken to be its own, at least.
  const double known_variance =
      std::pow(session_options(s).prior_inflation * 0.2, 2) * known.covariance(d, d);
  const double variance = (later.result.calibration.covariance(d, d) - kWidth_s * kWidth_s / 12) /
                          std::pow(excess_of(later), 2);
  EXPECT_NEAR(share, variance / known_variance, 0.3 * share);
}

TEST(CheckedCalibration, EndsSoonWhenItIsCancelled) {
  const test::Simulation s = test::arrival_stamped_camera();
  CheckedCalibrationOptions options = session_options(s);
  int asked = 0;
  options.is_cancelled = [&asked] { return ++asked > 0; };
  const CheckedCalibration cancelled = calibrate_session(session_of(s, 1), options, nullptr);
  EXPECT_EQ(cancelled.result.status, CalibrationStatus::kCancelled);
  EXPECT_EQ(asked, 1);
  EXPECT_FALSE(cancelled.refusal.empty());
}

}  // namespace
}  // namespace alidade

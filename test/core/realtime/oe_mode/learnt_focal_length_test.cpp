// OE mode behind a lens that did not come back to where its calibration has it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/realtime/oe_mode/oe_mode.h"
#include "test/core/realtime/oe_mode/virtual_camera.h"

namespace alidade::test {
namespace {

constexpr int kOfFocalLength = index(Parameter::kFocalLength);

class ReturnedLens : public testing::Test {
 protected:
  // As a zoom curve tells it: off by so much, with this standard deviation.
  [[nodiscard]] Calibration told(double log_change, double sigma) const {
    Calibration calibration = camera_.calibration();
    calibration.camera.focal_length *= std::exp(-log_change);
    calibration.covariance(kOfFocalLength, kOfFocalLength) =
        std::pow(sigma * calibration.camera.focal_length, 2);
    return calibration;
  }

  OeStatus process(int k) {
    const InterpolatedPanTilt telemetry = camera_.telemetry(k, sigmas_);
    const OeStatus status =
        oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry, &frame_);
    oe_.maintain();
    return status;
  }

  [[nodiscard]] double log_error() const {
    return std::log(frame_.calibration.camera.focal_length /
                    camera_.calibration().camera.focal_length);
  }
  [[nodiscard]] double log_sigma() const {
    return std::sqrt(frame_.calibration.covariance(kOfFocalLength, kOfFocalLength)) /
           frame_.calibration.camera.focal_length;
  }

  // Telemetry of an encoder: what contradicts a wrong focal length.
  Sigmas sigmas_{0.1 * kPixel, 1 * kPixel};
  VirtualCamera camera_;
  OeMode oe_{small_options()};
  FrameOrientation frame_;
};

TEST_F(ReturnedLens, ContradictsTelemetryWhereItsFocalLengthIsNotLearnt) {
  oe_.reset(told(0.01, 0.005));
  int contradictions = 0;
  for (int k = 0; k < 60; ++k) contradictions += process(k) == OeStatus::kContradiction ? 1 : 0;
  EXPECT_GT(contradictions, 10);
}

TEST_F(ReturnedLens, IsLearntAndNeverContradictsTelemetry) {
  for (const double change : {0.01, -0.003, 0.0}) {
    SCOPED_TRACE(change);
    oe_.reset(told(change, 0.005), FocalLength::kLearnt);
    for (int k = 0; k < 150; ++k) {
      ASSERT_EQ(process(k), k == 0 ? OeStatus::kTooFew : OeStatus::kOk) << k;
      expect_honest(camera_, k, frame_);
      EXPECT_LT(std::abs(log_error()), 5 * log_sigma()) << k;
    }
    EXPECT_LT(log_sigma(), 1.2e-4);
    double px = 0;
    double square = 0;
    camera_.judge(149, frame_, &px, &square);
    EXPECT_LT(px, 0.15);
  }
}

TEST_F(ReturnedLens, ErrsAsItsSigmaSays) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  constexpr int kRuns = 40;
  constexpr int kFrames = 40;
  constexpr double kSigma = 0.003;
  std::vector<double> squares(kFrames, 0.0);
  std::vector<double> of_error(kFrames, 0.0);
  for (int run = 0; run < kRuns; ++run) {
    oe_.reset(told(kSigma * normal(random), kSigma), FocalLength::kLearnt);
    const int from = (run * 7) % 90;
    for (int k = 0; k < kFrames; ++k) {
      ASSERT_EQ(process(from + k), k == 0 ? OeStatus::kTooFew : OeStatus::kOk) << run << ' ' << k;
      squares[static_cast<std::size_t>(k)] += std::pow(log_error() / log_sigma(), 2) / kRuns;
      of_error[static_cast<std::size_t>(k)] += std::pow(log_error() / kSigma, 2) / kRuns;
    }
  }
  // Means of chi-squares of 1 degree: four standard deviations, of each frame.
  for (const double square : squares) EXPECT_LT(square, 1 + 4 * std::sqrt(2.0 / kRuns));
  // It learns.
  EXPECT_LT(of_error.back(), 0.03 * of_error.front());
}

TEST_F(ReturnedLens, IsTheCalibrationsWhereThatIsExact) {
  const Calibration exact = told(0.001, 0);
  OeMode plain(small_options());
  plain.reset(exact);
  oe_.reset(exact, FocalLength::kLearnt);
  for (int k = 0; k < 20; ++k) {
    const InterpolatedPanTilt telemetry = camera_.telemetry(k);
    FrameOrientation frame;
    EXPECT_EQ(oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry, &frame_),
              plain.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry, &frame));
    EXPECT_EQ(frame.angle.vector(), frame_.angle.vector());
    EXPECT_EQ(frame.motion_covariance, frame_.motion_covariance);
    EXPECT_EQ(frame.calibration.camera.focal_length, exact.camera.focal_length);
    oe_.maintain();
    plain.maintain();
  }
}

TEST_F(ReturnedLens, IsTheLearntOneInAnswersOfTelemetry) {
  oe_.reset(told(0.005, 0.005), FocalLength::kLearnt);
  for (int k = 0; k < 60; ++k) ASSERT_NE(process(k), OeStatus::kContradiction) << k;
  const double f = frame_.calibration.camera.focal_length;
  const double sigma = log_sigma();
  const std::vector<std::uint8_t> black(static_cast<std::size_t>(kWidth) * kHeight, 0);
  const InterpolatedPanTilt telemetry = camera_.telemetry(60);
  EXPECT_EQ(oe_.process({black.data(), kWidth, kHeight, kWidth}, VirtualCamera::time_s(60),
                        &telemetry, &frame_),
            OeStatus::kTooFew);
  EXPECT_EQ(frame_.mode, OrientationMode::kPt);
  EXPECT_NEAR(std::log(frame_.calibration.camera.focal_length / f), 0, sigma);
  EXPECT_LT(log_sigma(), 1.5 * sigma);
  // A reset begins anew.
  oe_.reset(told(0.005, 0.005), FocalLength::kLearnt);
  ASSERT_EQ(process(61), OeStatus::kTooFew);
  EXPECT_NEAR(log_sigma(), 0.005, 1e-9);
}

// What telemetry that comes late tells is learnt as well.
TEST_F(ReturnedLens, IsLearntFromLateTelemetry) {
  oe_.reset(told(0.004, 0.004), FocalLength::kLearnt);
  for (int k = 0; k < 120; ++k) {
    const InterpolatedPanTilt early = camera_.extrapolated(k, 0.04);
    static_cast<void>(oe_.process(camera_.image(k), VirtualCamera::time_s(k), &early, &frame_));
    oe_.maintain();
    expect_honest(camera_, k, frame_);
    TelemetryLookUp asked;
    while (oe_.pending(VirtualCamera::time_s(k - 1), &asked)) {
      const InterpolatedPanTilt late =
          camera_.telemetry(static_cast<int>(std::lround(asked.time_s * kRateHz)), sigmas_);
      oe_.settle_pending(&late);
    }
  }
  EXPECT_EQ(oe_.statistics().status, OeStatus::kOk);
  EXPECT_LT(log_sigma(), 4e-4);
  EXPECT_LT(std::abs(log_error()), 5 * log_sigma());
}

// A map is that of the calibration which was given, whatever was learnt meanwhile.
TEST_F(ReturnedLens, HandsItsMapOnAsByTheCalibrationThatWasGiven) {
  const Calibration given = told(0.004, 0.004);
  oe_.reset(given, FocalLength::kLearnt);
  for (int k = 0; k < 60; ++k) ASSERT_NE(process(k), OeStatus::kContradiction);
  const MapState map = oe_.map_state();
  OeMode other(small_options());
  other.reset(given, map, FocalLength::kLearnt);
  const InterpolatedPanTilt telemetry = camera_.telemetry(60, sigmas_);
  EXPECT_EQ(other.process(camera_.image(60), VirtualCamera::time_s(60), &telemetry, &frame_),
            OeStatus::kOk);
  expect_honest(camera_, 60, frame_);
}

}  // namespace
}  // namespace alidade::test

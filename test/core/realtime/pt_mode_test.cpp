// PT mode against a forward model of its own (pixel_truth.h): its errors are as large as its covariance
// says, over the whole frame, for every kind of camera. A mean over N independent runs of a normalised
// squared error of n dimensions has the standard deviation sqrt(2 / (n N)).

#include "core/realtime/pt_mode.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <random>
#include <string>

#include "core/model/direction.h"
#include "test/core/realtime/pixel_truth.h"

namespace alidade {
namespace {

struct Case {
  std::string name;
  Camera<double> camera{32008, 1, {55.4}, 1920, 1080};
  double line_delay = -14.2e-6;
  double clock_offset = -84.4e-3;
  double pan_scale = 1;
  double tilt_scale = 1;
  double pan_centre = 0.4;      // rad
  double rate_hz = 30;          // of the telemetry
  double angle_sigma = 3e-5;    // rad
  double stamp_sigma = 1e-3;    // s
  double period_sigma = 50e-6;  // s
  double frame_sigma = 1e-3;    // s
  double beyond = -1;           // s, from the newest sample to the middle row; negative: inside
  double acceleration_sigma =
      0;  // rad/s^2, of a mount whose acceleration is constant; 0: paper's path
  bool uncertain_calibration = false;
  double least_mean =
      1;  // of the normalised error, where the model is known to be on the safe side
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class PtModeErrors : public testing::TestWithParam<Case> {};

constexpr int kPtRuns = 1000;

double normalised(const Vector2<double>& error, const Matrix2<double>& covariance) {
  return error.dot(covariance.ldlt().solve(error)) / 2;
}

TEST_P(PtModeErrors, AreWhatTheCovarianceSays) {
  const Case& c = GetParam();
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);

  Calibration calibration;
  calibration.camera = c.camera;
  calibration.line_delay = c.line_delay;
  calibration.clock_offset = c.clock_offset;
  calibration.mechanics.pan_axis = Vector3<double>(0.012, 0.003, 1).normalized();
  calibration.mechanics.tilt_axis = Vector3<double>(-0.004, 1, 0.014).normalized();
  calibration.mechanics.pan_scale = c.pan_scale;
  calibration.mechanics.tilt_scale = c.tilt_scale;
  if (c.uncertain_calibration) {
    calibration.covariance.diagonal() << 25 * 25, 1e-10, 0.2 * 0.2, 1, 4, 1e-14, 4e-10, 4e-10,
        4e-10, 4e-10, 1e-8, 1e-8, 1e-6;
  }
  TelemetryNoise noise;
  noise.pan_tilt_sigma = c.angle_sigma;
  noise.period_sigma_s = c.period_sigma;
  if (c.acceleration_sigma > 0) noise.acceleration_sigma = c.acceleration_sigma;

  double angle_sum = 0;
  double rate_sum = 0;
  double direction_sum = 0;
  double pixel_sum = 0;
  double worst_pixel = 0;
  for (int run = 0; run < kPtRuns; ++run) {
    // The truth, of which the calibration is an estimate.
    ParameterCovariance<double> sigma = ParameterCovariance<double>::Zero();
    sigma.diagonal() = calibration.covariance.diagonal().cwiseSqrt();
    Matrix<double, kParameterCount, 1> x;
    for (int i = 0; i < kParameterCount; ++i) x[i] = sigma(i, i) * normal(random);
    const test::TrueCamera camera{
        c.camera.focal_length + x[0],
        c.camera.aspect + x[1],
        c.camera.distortion.radial + x[2],
        c.camera.width,
        c.camera.height,
        c.line_delay + x[index(Parameter::kLineDelay)],
        direction_plus<double>(calibration.mechanics.pan_axis,
                               x.segment<2>(index(Parameter::kPanAxis0))),
        direction_plus<double>(calibration.mechanics.tilt_axis,
                               x.segment<2>(index(Parameter::kTiltAxis0))),
        x.segment<2>(index(Parameter::kCentreU))};
    const double pan_scale = c.pan_scale + x[index(Parameter::kPanScale)];
    const double tilt_scale = c.tilt_scale + x[index(Parameter::kTiltScale)];
    const double clock_offset = c.clock_offset + x[index(Parameter::kClockOffset)];

    // True (pan, tilt) by image time. The paper's path: three times as wide as the image, as high.
    const double phase = 10 * uniform(random);
    const Eigen::Vector2d rate(0.05 * normal(random), 0.03 * normal(random));
    const Eigen::Vector2d acceleration(c.acceleration_sigma * normal(random),
                                       c.acceleration_sigma * normal(random));
    const std::function<Eigen::Vector2d(double)> path = [&](double t) -> Eigen::Vector2d {
      if (c.acceleration_sigma > 0) {
        return Eigen::Vector2d(c.pan_centre, 0.1) + rate * t + acceleration * (t * t / 2);
      }
      const double loop = 2 * kPi / 10 * (t + phase);
      return {c.pan_centre + 0.09 * std::cos(loop), 0.1 + 0.017 * std::sin(3 * loop)};
    };

    const double frame_time = uniform(random);
    const double middle_time = frame_time + 0.5 * c.camera.height * camera.line_delay;
    const double period = 1 / c.rate_hz;
    const double newest =
        c.beyond < 0 ? middle_time + period * (15 + uniform(random)) : middle_time - c.beyond;
    const double own_sigma = std::min(c.stamp_sigma, c.period_sigma / std::sqrt(2));
    const double shared =
        std::sqrt(c.stamp_sigma * c.stamp_sigma - own_sigma * own_sigma) * normal(random);
    TelemetryBuffer<128> telemetry(noise);
    for (int i = 40; i >= 0; --i) {
      const double time = newest - i * period;
      const Eigen::Vector2d angle = path(time);
      ASSERT_EQ(
          telemetry.push({time + clock_offset + shared + own_sigma * normal(random), c.stamp_sigma,
                          wrap_angle(pan_scale * angle.x() + c.angle_sigma * normal(random)),
                          tilt_scale * angle.y() + c.angle_sigma * normal(random)}),
          PushStatus::kStored);
    }

    FrameOrientation frame;
    const QueryStatus status = pt_orientation(
        calibration, telemetry, frame_time + c.frame_sigma * normal(random), c.frame_sigma, &frame);
    ASSERT_TRUE(has_result(status)) << to_string(status);
    if (c.beyond < 0) {
      ASSERT_EQ(status, QueryStatus::kOk);
    }

    if (!c.uncertain_calibration) {
      const Eigen::Vector2d true_angle = path(frame_time);
      const double h = 1e-4;
      const Eigen::Vector2d true_rate = (path(middle_time + h) - path(middle_time - h)) / (2 * h);
      angle_sum += normalised(minus(frame.angle, {true_angle.x(), true_angle.y()}),
                              frame.motion_covariance.topLeftCorner<2, 2>());
      rate_sum +=
          normalised(frame.rate.vector() - true_rate, frame.motion_covariance.block<2, 2>(2, 2));
    }
    double run_direction_sum = 0;
    double run_pixel_sum = 0;
    constexpr int kGrid = 5;
    for (int i = 0; i < kGrid; ++i) {
      for (int j = 0; j < kGrid; ++j) {
        const Vector2<double> u(c.camera.width * i / (kGrid - 1.0),
                                c.camera.height * j / (kGrid - 1.0));
        const Vector3<double> truth = test::true_direction(camera, path, frame_time, u);
        Vector3<double> d_b;
        Matrix2<double> covariance;
        ASSERT_EQ(frame.direction(u, &d_b, &covariance), ProjectionStatus::kOk);
        run_direction_sum += normalised(tangent_basis(d_b).transpose() * (truth - d_b), covariance);
        Vector2<double> seen;
        Matrix2<double> pixel_covariance;
        ASSERT_EQ(frame.pixel(truth, &seen, &pixel_covariance), ProjectionStatus::kOk);
        run_pixel_sum += normalised(seen - u, pixel_covariance);
        worst_pixel = std::max(worst_pixel, (seen - u).norm());
      }
    }
    direction_sum += run_direction_sum / (kGrid * kGrid);
    pixel_sum += run_pixel_sum / (kGrid * kGrid);
  }
  // A run's mean over its pixels varies no more than one pixel does.
  const double tolerance = 4 * std::sqrt(2.0 / (2 * kPtRuns));
  const auto expect_honest = [&](double sum, const char* what) {
    EXPECT_LT(sum / kPtRuns, 1 + tolerance) << what;
    EXPECT_GT(sum / kPtRuns, c.least_mean - tolerance) << what;
  };
  if (!c.uncertain_calibration) {
    expect_honest(angle_sum, "angles");
    expect_honest(rate_sum, "rates");
  }
  expect_honest(direction_sum, "directions");
  expect_honest(pixel_sum, "pixels");
  EXPECT_GT(worst_pixel, 0.1) << "without errors there is nothing to normalise";
}

Case with(const std::string& name, const std::function<void(Case&)>& change) {
  Case c;
  c.name = name;
  change(c);
  return c;
}

INSTANTIATE_TEST_SUITE_P(
    Cases, PtModeErrors,
    testing::Values(with("ThePapersCamera", [](Case&) {}),
                    with("LargeLineDelay", [](Case& c) { c.line_delay = 30e-6; }),
                    with("LargeNegativeLineDelay", [](Case& c) { c.line_delay = -30e-6; }),
                    with("WideAngleWithBarrelDistortion",
                         [](Case& c) {
                           c.camera = {1200, 1.02, {-0.12}, 1920, 1080};
                           c.line_delay = 30e-6;
                           c.angle_sigma = 3e-4;
                         }),
                    with("PanAtHalfATurn", [](Case& c) { c.pan_centre = kPi; }),
                    with("ScaledAngles",
                         [](Case& c) {
                           c.pan_scale = 1.05;
                           c.tilt_scale = 0.9;
                         }),
                    with("FastTelemetry",
                         [](Case& c) {
                           c.rate_hz = 100;
                           c.angle_sigma = 1e-4;
                         }),
                    with("JitteringStamps",
                         [](Case& c) {
                           c.period_sigma = std::sqrt(2) * 1e-3;
                           c.frame_sigma = 0;
                         }),
                    with("UncertainCalibration", [](Case& c) { c.uncertain_calibration = true; }),
                    with("JustBeyondTheNewestSample",
                         [](Case& c) {
                           c.beyond = 0.005;
                           c.acceleration_sigma = 0.05;
                           c.least_mean = 0.8;
                         }),
                    with("FarBeyondTheNewestSample",
                         [](Case& c) {
                           c.beyond = 0.1;
                           c.acceleration_sigma = 0.05;
                           // An acceleration seen in the samples enlarges the one expected: with a normal z,
                           // the mean of z^2 / max(1, z^2) is 0.516.
                           c.least_mean = 0.516;
                         })),
    [](const testing::TestParamInfo<Case>& instance) { return instance.param.name; });

Calibration simple_calibration(double line_delay) {
  Calibration calibration;
  calibration.camera = {1000, 1, {0}, 640, 480};
  calibration.line_delay = line_delay;
  calibration.clock_offset = 0.25;
  return calibration;
}

TEST(PtMode, LooksUpTheImageTimePlusTheClockOffset) {
  for (const double line_delay : {0.0, 50e-6, -50e-6}) {
    TelemetryBuffer<32> telemetry;
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(telemetry.push({0.05 * i, 0, 0.3 * 0.05 * i, -0.1 * 0.05 * i}),
                PushStatus::kStored);
    }
    FrameOrientation frame;
    ASSERT_EQ(pt_orientation(simple_calibration(line_delay), telemetry, 0.2, 0, &frame),
              QueryStatus::kOk);
    EXPECT_EQ(frame.mode, OrientationMode::kPt);
    EXPECT_EQ(frame.time_s, 0.2);
    EXPECT_NEAR(frame.angle.pan, 0.3 * 0.45, 1e-12);
    EXPECT_NEAR(frame.angle.tilt, -0.1 * 0.45, 1e-12);
    EXPECT_NEAR(frame.rate.pan, 0.3, 1e-10);
  }
}

TEST(PtMode, DividesByTheScales) {
  Calibration calibration = simple_calibration(0);
  calibration.mechanics.pan_scale = 1.5;
  calibration.mechanics.tilt_scale = 0.5;
  TelemetryBuffer<32> telemetry;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(telemetry.push({0.05 * i, 0, 0.3 * 0.05 * i, 0.1 * 0.05 * i}), PushStatus::kStored);
  }
  FrameOrientation frame;
  ASSERT_EQ(pt_orientation(calibration, telemetry, 0.2, 0, &frame), QueryStatus::kOk);
  EXPECT_NEAR(frame.angle.pan, 0.3 * 0.45 / 1.5, 1e-12);
  EXPECT_NEAR(frame.angle.tilt, 0.1 * 0.45 / 0.5, 1e-12);
  EXPECT_NEAR(frame.rate.tilt, 0.1 / 0.5, 1e-10);
  calibration.mechanics.pan_scale = 0;
  EXPECT_EQ(pt_orientation(calibration, telemetry, 0.2, 0, &frame), QueryStatus::kNotFinite);
}

TEST(PtMode, TurnsTheMeasuredCovarianceIntoTheTrueOneAtRow0) {
  Calibration calibration = simple_calibration(50e-6);
  calibration.mechanics.pan_scale = 1.5;
  calibration.mechanics.tilt_scale = 0.5;
  Matrix4<double> root;
  root << 3, 0, 1, 2, 1, 2, 0, 1, 0, 2, 4, 1, 2, 0, 1, 5;
  InterpolatedPanTilt measured;
  measured.covariance = root * root.transpose();
  FrameOrientation frame;
  ASSERT_TRUE(pt_orientation(calibration, 0, measured, &frame));
  const double half = 50e-6 * 240;
  Matrix4<double> J;  // d true (pan, tilt, rates) at row 0 / d measured at the middle row
  J << 1 / 1.5, 0, -half / 1.5, 0,  //
      0, 2, 0, -half * 2,           //
      0, 0, 1 / 1.5, 0,             //
      0, 0, 0, 2;
  const Matrix4<double> expected = J * measured.covariance * J.transpose();
  const MotionCovariance& found = frame.motion_covariance;
  EXPECT_LT((found.topLeftCorner<4, 4>() - expected).norm(), 1e-12 * expected.norm());
  EXPECT_EQ(found.bottomRows<2>().norm(), 0) << "PT mode knows no acceleration";
}

TEST(PtMode, AddsWhatAnAccelerationDoesToTheRows) {
  Calibration calibration = simple_calibration(-50e-6);
  calibration.mechanics.pan_scale = 1.5;
  calibration.mechanics.tilt_scale = 0.5;
  InterpolatedPanTilt measured;
  // As measured: true ones of 2 and 3 rad/s^2.
  measured.acceleration_square = {4 * 1.5 * 1.5, 9 * 0.5 * 0.5};
  FrameOrientation frame;
  ASSERT_TRUE(pt_orientation(calibration, 0, measured, &frame));
  double mean = 0;
  const int rows = 480;
  for (int row = 0; row < rows; ++row) {
    const double time = -50e-6 * (row + 0.5 - 240);
    mean += std::pow(time * time / 2, 2) / rows;
  }
  EXPECT_NEAR(frame.motion_covariance(0, 0), 4 * mean, 1e-3 * mean);
  EXPECT_NEAR(frame.motion_covariance(1, 1), 9 * mean, 1e-3 * mean);
}

// The same telemetry by one calibration and by another, at all rows of the frame.
TEST(PtMode, FollowsClockOffsetAndLineDelayAsItsSensitivitySays) {
  TelemetryBuffer<32> telemetry;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(telemetry.push({0.05 * i, 0, 0.3 * 0.05 * i, -0.1 * 0.05 * i}), PushStatus::kStored);
  }
  const Calibration calibration = simple_calibration(50e-6);
  const auto angle_with = [&](Parameter parameter, double change, FrameOrientation* frame) {
    Calibration changed = calibration;
    if (parameter == Parameter::kLineDelay) changed.line_delay += change;
    if (parameter == Parameter::kClockOffset) changed.clock_offset += change;
    EXPECT_EQ(pt_orientation(changed, telemetry, 0.2, 0, frame), QueryStatus::kOk);
    return frame->angle.vector();
  };
  for (const Parameter parameter : {Parameter::kLineDelay, Parameter::kClockOffset}) {
    const double step = parameter == Parameter::kLineDelay ? 1e-6 : 1e-3;
    FrameOrientation frame;
    const Vector2<double> numeric =
        (angle_with(parameter, step, &frame) - angle_with(parameter, -step, &frame)) / (2 * step);
    angle_with(parameter, 0, &frame);
    const Vector2<double> told = frame.motion_sensitivity.col(index(parameter)).head<2>();
    EXPECT_LT((told - numeric).norm(), 1e-6) << to_string(parameter);
    EXPECT_EQ(numeric.norm() > 0.1, parameter == Parameter::kClockOffset)
        << "row 0 is looked up at its own time";
  }
}

TEST(PtMode, SaysWhyThereIsNoOrientation) {
  const Calibration calibration = simple_calibration(0);
  TelemetryBuffer<32> telemetry;
  FrameOrientation frame;
  EXPECT_EQ(pt_orientation(calibration, telemetry, 0, 0, &frame), QueryStatus::kEmpty);
  ASSERT_EQ(telemetry.push({0, 0, 0, 0}), PushStatus::kStored);
  EXPECT_EQ(pt_orientation(calibration, telemetry, 0, 0, &frame), QueryStatus::kOneSample);
  ASSERT_EQ(telemetry.push({0.1, 0, 0.1, 0}), PushStatus::kStored);
  EXPECT_EQ(pt_orientation(calibration, telemetry, 5, 0, &frame), QueryStatus::kTelemetryTooOld);
  EXPECT_EQ(pt_orientation(calibration, telemetry, -5, 0, &frame), QueryStatus::kBeforeTelemetry);
  EXPECT_EQ(pt_orientation(calibration, telemetry, NAN, 0, &frame), QueryStatus::kNotFinite);
  EXPECT_EQ(frame.mode, OrientationMode::kNone) << "nothing was written";
  EXPECT_EQ(pt_orientation(calibration, telemetry, -0.1, 0, &frame), QueryStatus::kExtrapolated);
  EXPECT_EQ(frame.mode, OrientationMode::kPt);
}

}  // namespace
}  // namespace alidade

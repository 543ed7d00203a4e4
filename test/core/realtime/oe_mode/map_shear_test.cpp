// The shear of the map: what is corrected is what was wrong, everywhere alike, and no more than is sure.

#include "core/realtime/oe_mode/map_shear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade::test {
namespace {

constexpr double kShearPeriod_s = 0.04;

Calibration sheared_calibration() {
  Calibration calibration;
  calibration.camera = {1500, 1, {0}, 480, 270};
  calibration.line_delay = 50e-6;
  return calibration;
}

// A path without surprises, pan and tilt.
Vector2<double> angle(double t) {
  return {0.1 + 0.2 * t - 0.1 * t * t, -0.05 + 0.02 * t + 0.05 * t * t};
}
Vector2<double> rate(double t) { return {0.2 - 0.2 * t, 0.02 + 0.1 * t}; }
Vector2<double> acceleration() { return {-0.2, 0.1}; }

FrameMotion<double> motion_of(const Vector2<double>& angles, const Vector2<double>& rates,
                              const Vector2<double>& accelerations) {
  return {{angles.x(), angles.y()},
          {rates.x(), rates.y()},
          135,
          {accelerations.x(), accelerations.y()}};
}

Matrix6 frame_covariance() {
  Matrix6 out = Matrix6::Zero();
  out.diagonal() << 1e-12, 1e-12, 1e-8, 1e-8, 1e-4, 1e-4;
  return out;
}

// Of the motion that the map began with, one standard deviation.
constexpr double kRateSigma = 1e-2;         // rad/s
constexpr double kAccelerationSigma = 0.3;  // rad/s^2

Matrix6 first_covariance() {
  Matrix6 out = frame_covariance();
  out.diagonal().segment<2>(2).setConstant(kRateSigma * kRateSigma);
  out.diagonal().tail<2>().setConstant(kAccelerationSigma * kAccelerationSigma);
  return out;
}

ShearCorrection some_correction() {
  ShearCorrection out;
  out.rate = {3e-3, -2e-3};
  out.acceleration = {0.4, -0.7};
  out.tilt = 0.1;
  out.s_per_rad = -0.075;
  out.half_readout_s = 0.007;
  return out;
}

// A motion that is straightened is a motion: its rate is the derivative of its angle, its acceleration that of
// its rate, at every row of the frame.
TEST(ShearCorrection, TakesAngleRateAndAccelerationAlike) {
  const ShearCorrection correction = some_correction();
  const auto taken = [&](double t) {
    Vector2<double> angles(0.3, correction.tilt + t / correction.s_per_rad);
    Vector2<double> rates(0, 0);
    Vector2<double> accelerations(0, 0);
    const Vector2<double> before = angles;
    correction.straighten(&angles, &rates, &accelerations);
    Matrix<double, 6, 1> out;
    out << angles - before, rates, accelerations;
    return out;
  };
  constexpr double h = 1e-4;
  for (const double t : {-0.006, -0.003, 0.0, 0.002, 0.006}) {
    const Matrix<double, 6, 1> slope = (taken(t + h) - taken(t - h)) / (2 * h);
    EXPECT_LT((taken(t).segment<2>(2) - slope.head<2>()).norm(), 1e-9) << t;
    EXPECT_LT((taken(t).tail<2>() - slope.segment<2>(2)).norm(), 1e-9) << t;
  }
}

// A map whose landmarks were placed by a frame with wrong rate and acceleration becomes the map of a frame with
// the right ones.
TEST(ShearCorrection, GivesTheLandmarksThatARightMotionWouldHaveGiven) {
  const Calibration calibration = sheared_calibration();
  const FrameMotion<double> right = motion_of(angle(0), rate(0), acceleration());
  ShearCorrection correction;
  correction.rate = {2e-3, -3e-3};
  correction.acceleration = {0.1, 0.2};
  correction.tilt = right.angle.tilt;
  correction.s_per_rad = -calibration.line_delay * calibration.camera.focal_length;
  correction.half_readout_s = calibration.line_delay * 135;
  FrameMotion<double> wrong = right;
  wrong.rate = {right.rate.pan + 2e-3, right.rate.tilt - 3e-3};
  wrong.acceleration = {right.acceleration.pan + 0.1, right.acceleration.tilt + 0.2};
  LandmarkMap map(100, 1e-3);
  std::vector<Vector3<double>> expected(100);
  for (double v = 5; v < 270; v += 33) {
    for (double u = 10; u < 480; u += 60) {
      Landmark landmark;
      Vector3<double> d = Vector3<double>::Zero();
      int slot = -1;
      ASSERT_EQ(rolling_shutter_unproject(calibration.camera, calibration.mechanics,
                                          calibration.line_delay, wrong, {u, v}, &landmark.d),
                ProjectionStatus::kOk);
      ASSERT_EQ(rolling_shutter_unproject(calibration.camera, calibration.mechanics,
                                          calibration.line_delay, right, {u, v}, &d),
                ProjectionStatus::kOk);
      ASSERT_EQ(map.insert(landmark, 0, &slot), InsertStatus::kOk);
      expected[static_cast<std::size_t>(slot)] = d;
    }
  }
  double before = 0;
  double after = 0;
  const auto worst = [&] {
    double out = 0;
    for (int slot = 0; slot < map.size(); ++slot) {
      out = std::max(out, (map.at(slot).d - expected[static_cast<std::size_t>(slot)]).norm());
    }
    return out;
  };
  before = worst();
  correction.straighten(calibration, wrong, &map);
  after = worst();
  EXPECT_GT(before, 1e-5);
  // What the elevation leaves of the row: the image is 10 degrees high.
  EXPECT_LT(after, 0.05 * before);
}

class ShearedFrames : public testing::Test {
 protected:
  ShearedFrames() { shear_.reset(sheared_calibration()); }

  void begin() { shear_.begin(motion_of(angle(0), rate(0), acceleration()), first_covariance()); }

  // Frame k, as a map shows it whose rates and accelerations are wrong by so much.
  void add(int k, const Vector2<double>& wrong_rate, const Vector2<double>& wrong_acceleration) {
    const double t = k * kShearPeriod_s;
    shear_.add_frame(t,
                     motion_of(angle(t), rate(t) + wrong_rate, acceleration() + wrong_acceleration),
                     frame_covariance());
  }

  MapShear shear_{MapShearOptions{}};
};

TEST_F(ShearedFrames, TellTheRateThatTheMapGotWrong) {
  const Vector2<double> wrong_rate(1.2 * kRateSigma, -1.9 * kRateSigma);
  const Vector2<double> wrong_acceleration(0.05, -0.04);
  begin();
  for (int k = 0; k < 5; ++k) {
    add(k, wrong_rate, wrong_acceleration);
    EXPECT_FALSE(shear_.correct()) << "too few frames";
  }
  add(5, wrong_rate, wrong_acceleration);
  EXPECT_TRUE(shear_.correct());  // the curve has surprised nobody yet
  for (int k = 6; k < 12; ++k) add(k, wrong_rate, wrong_acceleration);
  const double before = shear_.covariances()[0](1, 1);
  const auto correction = shear_.correct();
  ASSERT_TRUE(correction);
  EXPECT_LT((correction->rate - wrong_rate).norm(), 0.05 * wrong_rate.norm());
  EXPECT_TRUE(correction->crooked);
  for (int axis = 0; axis < 2; ++axis) {
    const double sigma = std::sqrt(shear_.covariances()[static_cast<std::size_t>(axis)](1, 1));
    EXPECT_LT(std::abs(correction->rate[axis] - wrong_rate[axis]), 4 * sigma);
    EXPECT_NEAR(correction->acceleration[axis], wrong_acceleration[axis], 0.01);
  }
  EXPECT_LT(shear_.covariances()[0](1, 1), before / 100);
  // The frames that it knows are straight now: there is nothing left to correct.
  const double known = shear_.covariances()[0](1, 1);
  const auto again = shear_.correct();
  ASSERT_TRUE(again);
  EXPECT_LE(shear_.covariances()[0](1, 1), known) << "no reason to doubt it";
  EXPECT_LT(again->rate.norm(), 0.02 * wrong_rate.norm());
  EXPECT_FALSE(again->crooked);
}

// Far from where the map began a wrong rate has made a wrong angle, too: the offset goes back with the landmarks.
TEST_F(ShearedFrames, TellWhatTheWrongRateHasMadeOfTheAngleOnTheWay) {
  constexpr double kWay = 0.3;  // rad, upwards
  Matrix6 covariance = first_covariance();
  covariance.diagonal().tail<2>().setConstant(1e-8);
  const Vector2<double> begun = angle(0) - Vector2<double>(0, kWay);
  shear_.begin(motion_of(begun, rate(0), acceleration()), covariance);
  const Vector2<double> wrong_rate(1.2 * kRateSigma, -0.9 * kRateSigma);
  for (int k = 0; k < 12; ++k) add(k, wrong_rate, {0, 0});
  const auto correction = shear_.correct();
  ASSERT_TRUE(correction);
  // Rows count downwards.
  const double t = -sheared_calibration().line_delay * 1500 * (correction->tilt - begun.y());
  EXPECT_LT(t, -0.02);
  EXPECT_LT((correction->angle - t * wrong_rate).norm(), 0.05 * std::abs(t) * wrong_rate.norm());
}

// Half of the landmarks with an error of their own share half of it with the map.
TEST_F(ShearedFrames, TakeOverTheirShareOfAFramesErrors) {
  shear_.inherit(0.5, first_covariance());
  const MapShear::Covariances& found = shear_.covariances();
  for (const Matrix3<double>& shear : found) {
    EXPECT_NEAR(shear(1, 1), kRateSigma * kRateSigma / 4, 1e-15);
    EXPECT_NEAR(shear(2, 2), kAccelerationSigma * kAccelerationSigma / 4, 1e-15);
    EXPECT_EQ(shear(0, 0), 0);
  }
}

TEST_F(ShearedFrames, AreNotBelievedWhereTheyTellMoreThanCanBe) {
  begin();
  for (int k = 0; k < 12; ++k) add(k, {30 * kRateSigma, 0}, {0, 0});
  const MapShear::Covariances before = shear_.covariances();
  const auto correction = shear_.correct();
  ASSERT_TRUE(correction);
  EXPECT_EQ(correction->rate.x(), 0);
  EXPECT_EQ(correction->angle.x(), 0);
  EXPECT_NEAR(shear_.covariances()[0](1, 1), 2 * before[0](1, 1), 0.05 * before[0](1, 1));
  EXPECT_LT(shear_.covariances()[1](1, 1), before[1](1, 1)) << "tilt is not in doubt";
}

TEST_F(ShearedFrames, BeginAnewAfterAGapAndWhereTimeRunsBackwards) {
  for (const int jump : {50, -3}) {
    begin();
    for (int k = 10; k < 16; ++k) add(k, {0, 0}, {0, 0});
    EXPECT_TRUE(shear_.correct());
    add(16 + jump, {0, 0}, {0, 0});
    EXPECT_FALSE(shear_.correct());
  }
}

TEST_F(ShearedFrames, TellNothingWithoutRollingShutter) {
  Calibration calibration = sheared_calibration();
  calibration.line_delay = 0;
  shear_.reset(calibration);
  begin();
  for (int k = 0; k < 12; ++k) add(k, {0, 0}, {0, 0});
  EXPECT_FALSE(shear_.correct());
}

// A lens that stands is found anew in each frame, a little beside where it was; one that moves shows the same map sheared by other rates.
TEST_F(ShearedFrames, TellThroughALensThatStandsAndNotThroughOneThatMoves) {
  for (const double zoom : {1e-5, 0.01}) {
    const Vector2<double> wrong_rate(1.2 * kRateSigma, -1.9 * kRateSigma);
    Calibration calibration = sheared_calibration();
    shear_.reset(calibration);
    begin();
    for (int k = 0; k < 12; ++k) {
      calibration.camera.focal_length *= 1 + (zoom < 1e-3 && k % 2 == 1 ? -zoom : zoom);
      shear_.change_lens(calibration);
      add(k, wrong_rate, {0, 0});
    }
    const auto correction = shear_.correct();
    EXPECT_EQ(correction.has_value(), zoom < 1e-3);
    if (correction) {
      EXPECT_LT((correction->rate - wrong_rate).norm(), 0.05 * wrong_rate.norm());
    }
  }
}

// Elsewhere a wrong acceleration is a wrong rate, and a wrong angle, and back again it is what it was.
TEST_F(ShearedFrames, HaveTheErrorsOfTheTiltTheyLookAt) {
  begin();
  const MapShear::Covariances before = shear_.covariances();
  const double tilt = shear_.tilt();
  const double t = sheared_calibration().line_delay * 1500 * 0.5;  // of half a rad
  shear_.move_to(tilt - 0.5);
  const double variance = kAccelerationSigma * kAccelerationSigma;
  EXPECT_NEAR(shear_.covariances()[0](1, 1), kRateSigma * kRateSigma + t * t * variance, 1e-15);
  EXPECT_NEAR(shear_.covariances()[0](0, 0),
              t * t * kRateSigma * kRateSigma + t * t * t * t / 4 * variance, 1e-15);
  Matrix6 sum = Matrix6::Zero();
  shear_.add_to(&sum);
  EXPECT_EQ(sum(0, 0), shear_.covariances()[0](0, 0));
  EXPECT_EQ(sum(3, 3), shear_.covariances()[1](1, 1));
  EXPECT_EQ(sum(2, 4), shear_.covariances()[0](1, 2));
  EXPECT_EQ(sum(0, 1), 0);
  EXPECT_EQ(shear_.angle_covariance()(1, 1), shear_.covariances()[1](0, 0));
  shear_.move_to(tilt);
  EXPECT_LT((shear_.covariances()[0] - before[0]).norm(), 1e-12);
}

// The errors of landmarks stay what they are, whatever lens looks at them.
TEST(MapShear, OfAnAngleIsTheSameThroughAnotherLens) {
  Calibration calibration = sheared_calibration();
  MapShear shear{MapShearOptions{}};
  shear.reset(calibration);
  shear.begin(motion_of(angle(0), rate(0), acceleration()), first_covariance());
  // As a frame sees it that looks a field of view higher.
  const auto there = [&] {
    MapShear moved{MapShearOptions{}};
    moved.reset(calibration);
    moved.set(shear.covariances(), shear.tilt());
    moved.move_to(shear.tilt() + 0.2);
    return moved.angle_covariance();
  };
  const Matrix2<double> before = there();
  const double rate_before = shear.covariances()[0](1, 1);
  calibration.camera.focal_length *= 4;
  shear.change_lens(calibration);
  EXPECT_LT((there() - before).norm(), 1e-9 * before.norm());
  EXPECT_NEAR(shear.covariances()[0](1, 1), rate_before / 16, 1e-9 * rate_before);
}

}  // namespace
}  // namespace alidade::test

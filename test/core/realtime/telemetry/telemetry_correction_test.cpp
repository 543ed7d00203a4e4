// Telemetry whose error is known is as good as telemetry without it.

#include "core/realtime/telemetry/telemetry_correction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace alidade::test {
namespace {

constexpr double kHeadNoise = 2e-5;  // rad
constexpr double kSample_s = 0.05;   // s

struct SineOfAngle {
  double amplitude;  // rad
  double period;     // rad
  [[nodiscard]] double at(double angle) const {
    return amplitude * std::sin(2 * kPi * angle / period + 0.4);
  }
};

// Learnt over +-0.35 rad, as a calibration would state it.
AngleErrorCurve learnt_curve(const SineOfAngle& gear) {
  AngleErrorCurve curve;
  curve.first_rad = -0.36;
  curve.count = AngleErrorCurve::kMaxKnots;
  curve.spacing_rad = 0.72 / (curve.count - 1);
  for (std::size_t i = 0; i < AngleErrorCurve::kMaxKnots; ++i) {
    curve.values[i] = gear.at(curve.first_rad + static_cast<double>(i) * curve.spacing_rad);
  }
  curve.length_rad = 0.02;
  curve.unseen_sigma_rad = gear.amplitude;
  return curve;
}

PanTilt<double> head_path(double t) {
  return {0.3 * std::sin(0.9 * t), 0.2 * std::sin(1.3 * t + 1)};
}

TelemetryNoise head_noise() {
  TelemetryNoise out;
  out.pan_tilt_sigma = kHeadNoise;
  return out;
}

// Root mean square of the interpolated angles' errors in white-noise sigmas, and of error / sigma.
struct AngleQuality {
  double rms = 0;
  double normalised = 0;
};

// off: the reading of a true angle, of pan and of tilt, without noise.
template <class Off>
AngleQuality run_head(const Mechanics<double>& mechanics, const TelemetryError& error,
                      std::uint64_t seed, const Off& off) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> white(0, kHeadNoise);
  TelemetryBuffer<256> buffer(head_noise());
  TelemetryCorrection correction(mechanics, error, kHeadNoise);
  AngleQuality out;
  int count = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = kSample_s * i;
    const PanTilt<double> read = off(head_path(t));
    TelemetrySample sample{t, 0, read.pan + white(random), read.tilt + white(random)};
    correction.correct(&sample);
    EXPECT_EQ(buffer.push(sample), PushStatus::kStored);
    if (i < 100) continue;
    const double at = t - 3.3 * kSample_s;
    InterpolatedPanTilt measured;
    EXPECT_EQ(buffer.query(at, 0, &measured), QueryStatus::kOk);
    correction.add_left(&measured);
    const Vector2<double> miss =
        minus(true_from_measured(mechanics, measured.angle), head_path(at));
    out.rms += miss.squaredNorm() / 2;
    out.normalised += (miss[0] * miss[0] / measured.covariance(0, 0) +
                       miss[1] * miss[1] / measured.covariance(1, 1)) /
                      2;
    ++count;
  }
  out.rms = std::sqrt(out.rms / count);
  out.normalised /= count;
  return out;
}

TEST(TelemetryCorrection, MakesAGearThatIsKnownAsGoodAsNone) {
  Mechanics<double> mechanics;
  mechanics.pan_scale = 1.02;
  const auto scaled = [&](const PanTilt<double>& angle) {
    return measured_from_true(mechanics, angle);
  };
  const AngleQuality without = run_head(mechanics, {}, 1, scaled);
  for (const SineOfAngle& gear :
       {SineOfAngle{2e-4, 0.105}, SineOfAngle{2e-3, 0.105}, SineOfAngle{2e-4, 0.05}}) {
    TelemetryError error;
    error.pan = error.tilt = learnt_curve(gear);
    ASSERT_TRUE(error.pan.validate());
    const auto geared = [&](const PanTilt<double>& angle) {
      const PanTilt<double> plain = scaled(angle);
      return PanTilt<double>{plain.pan + gear.at(angle.pan), plain.tilt + gear.at(angle.tilt)};
    };
    const AngleQuality with = run_head(mechanics, error, 1, geared);
    EXPECT_LT(with.rms, 1.2 * without.rms) << gear.amplitude;
    EXPECT_LT(with.normalised, 1.44 * without.normalised) << gear.amplitude;
    EXPECT_GT(run_head(mechanics, {}, 1, geared).rms, 3 * without.rms) << "not in vain";
  }
}

TEST(TelemetryCorrection, SaysWhatIsLeft) {
  TelemetryError error;
  error.pan = learnt_curve({2e-4, 0.105});
  error.pan.sigmas.fill(3e-5);
  error.tilt.unseen_sigma_rad = 1e-4;
  error.tilt.length_rad = 0.1;
  const TelemetryCorrection correction({}, error, kHeadNoise);
  InterpolatedPanTilt measured;
  measured.angle = {0.1, 0.2};
  measured.rate = {1, 2};
  correction.add_left(&measured);
  EXPECT_NEAR(measured.covariance(0, 0), 9e-10, 1e-18);
  EXPECT_NEAR(measured.covariance(1, 1), 1e-8, 1e-17);
  EXPECT_NEAR(measured.covariance(2, 2), 9e-10 / (0.02 * 0.02), 1e-12);
  EXPECT_NEAR(measured.covariance(3, 3), 1e-8 * 4 / (0.1 * 0.1), 1e-12);
  EXPECT_EQ(measured.error_variance[0], measured.covariance(0, 0));
  EXPECT_EQ(measured.error_length, (Vector2<double>(0.02, 0.1)));
  InterpolatedPanTilt unseen;
  unseen.angle = {2, 0.2};
  correction.add_left(&unseen);
  EXPECT_NEAR(unseen.covariance(0, 0), 4e-8, 1e-15);
}

// A camera behind the play of a motor, and a reading behind the play of a camera.
TEST(TelemetryCorrection, TakesThePlayOut) {
  constexpr double kWidth = 5e-4;
  for (const PlayKind kind : {PlayKind::kMotor, PlayKind::kOutput}) {
    TelemetryError error;
    error.pan_play = error.tilt_play = {kWidth, 1e-5, kind};
    PanTilt<double> before = head_path(0);
    PanTilt<double> reading = before;
    const auto with_play = [&](const PanTilt<double>& angle) {
      const auto axis = [&](double now, double was, double read) {
        if (kind == PlayKind::kOutput) {
          return std::clamp(read, now - kWidth / 2, now + kWidth / 2);
        }
        return now == was ? read : now + std::copysign(kWidth / 2, now - was);
      };
      reading = {axis(angle.pan, before.pan, reading.pan),
                 axis(angle.tilt, before.tilt, reading.tilt)};
      before = angle;
      return reading;
    };
    const AngleQuality quality = run_head({}, error, 3, with_play);
    EXPECT_LT(quality.normalised, 1.5) << static_cast<int>(kind);
    before = reading = head_path(0);
    EXPECT_LT(quality.rms, 0.5 * run_head({}, {}, 3, with_play).rms) << static_cast<int>(kind);
  }
}

TEST(TelemetryCorrection, LosesThePlaysStateWithTheSamples) {
  TelemetryError error;
  error.pan_play = {4e-4, 0, PlayKind::kMotor};
  TelemetryCorrection correction({}, error, 1e-7);
  const auto sigma = [&] {
    InterpolatedPanTilt measured;
    correction.add_left(&measured);
    return std::sqrt(measured.covariance(0, 0));
  };
  TelemetrySample sample{0, 0, 0.1, 0};
  correction.correct(&sample);
  EXPECT_NEAR(sigma(), 4e-4 / std::sqrt(12), 1e-6);
  sample = {1, 0, 0.11, 0};
  correction.correct(&sample);
  EXPECT_NEAR(sample.pan, 0.11 - 2e-4, 1e-12);
  EXPECT_LT(sigma(), 1e-6);
  // One that comes late is behind the same side, and moves nothing.
  sample = {0.5, 0, 0.105, 0};
  correction.correct(&sample);
  EXPECT_NEAR(sample.pan, 0.105 - 2e-4, 1e-12);
  sample = {1.5, 0, 0.1101, 0};
  correction.correct(&sample);
  EXPECT_NEAR(sample.pan, 0.1101 - 2e-4, 1e-12);
  correction.forget_state();
  sample = {2, 0, 0.1101, 0};
  correction.correct(&sample);
  EXPECT_NEAR(sigma(), 4e-4 / std::sqrt(12), 1e-6);
}

// A device that is polled faster than it measures.
TEST(TelemetryCorrection, LeavesARepeatARepeat) {
  TelemetryError error;
  error.pan_play = {4e-4, 0, PlayKind::kOutput};
  error.tilt_play = {4e-4, 0, PlayKind::kMotor};
  error.pan = learnt_curve({2e-4, 0.105});
  TelemetryCorrection correction({}, error, kHeadNoise);
  double pan = 0;
  double tilt = 0;
  for (int i = 0; i < 6; ++i) {
    TelemetrySample sample{0.1 * i, 0, 0.01 * (i / 2), -0.02 * (i / 2)};
    correction.correct(&sample);
    if (i % 2 == 1) {
      EXPECT_EQ(sample.pan, pan);
      EXPECT_EQ(sample.tilt, tilt);
    }
    pan = sample.pan;
    tilt = sample.tilt;
  }
}

TEST(TelemetryCorrection, IsNothingWhereNothingIsKnown) {
  TelemetryCorrection none;
  EXPECT_FALSE(none.exists());
  TelemetrySample sample{1, 0, 0.1, -0.3};
  none.correct(&sample);
  EXPECT_EQ(sample.pan, 0.1);
  EXPECT_EQ(sample.tilt, -0.3);
  InterpolatedPanTilt measured;
  measured.error_variance.setOnes();
  none.add_left(&measured);
  EXPECT_EQ(measured.covariance.norm(), 0);
  EXPECT_EQ(measured.error_variance.norm(), 0);
}

}  // namespace
}  // namespace alidade::test

// The covariance of an interpolated angle and rate is what the errors are, and the cubic is worth its
// while. Errors are normalised: e^T cov^-1 e / n has mean 1 and variance 2/n for an honest n x n
// covariance, so a mean over N independent runs lies within 4 sqrt(2 / (n N)) of 1 but for 1 in 16,000.

#include "core/realtime/telemetry/telemetry_interpolation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {
namespace {

class MeanNormalisedError {
 public:
  template <int kSize>
  void add(const Matrix<double, kSize, 1>& error, const Matrix<double, kSize, kSize>& covariance) {
    sum_ += error.dot(covariance.ldlt().solve(error)) / kSize;
    ++runs_;
    tolerance_factor_ = 4 * std::sqrt(2.0 / kSize);
  }
  [[nodiscard]] double mean() const { return sum_ / runs_; }
  [[nodiscard]] double tolerance() const { return tolerance_factor_ / std::sqrt(runs_); }

 private:
  double sum_ = 0;
  double runs_ = 0;
  double tolerance_factor_ = 0;
};

Vector4<double> error_of(const InterpolatedPanTilt& result, const PanTilt<double>& angle,
                         const PanTilt<double>& rate) {
  Vector4<double> error;
  error << minus(result.angle, angle), result.rate.vector() - rate.vector();
  return error;
}

// The paper's path at a field of view of 3.4 degrees: three times as wide, as high, 10 s a loop.
struct PaperPath {
  static constexpr double kSpeed = 2 * 3.14159265358979323846 / 10;
  static PanTilt<double> angle(double t) {
    return {0.09 * std::cos(kSpeed * t), 0.017 * std::sin(3 * kSpeed * t)};
  }
  static PanTilt<double> rate(double t) {
    return {-0.09 * kSpeed * std::sin(kSpeed * t), 0.017 * 3 * kSpeed * std::cos(3 * kSpeed * t)};
  }
};

TEST(TelemetryInterpolation, OfTwoSamplesHasTheCovarianceOfThePaper) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 3e-5;
  noise.period_sigma_s = 1e-4;
  noise.acceleration_sigma = 0;
  const double stamp_sigma = 2e-3;
  const double frame_sigma = 1e-3;
  TelemetryBuffer<8> buffer(noise);
  ASSERT_EQ(buffer.push({0, stamp_sigma, 0.1, 0.2}), PushStatus::kStored);
  ASSERT_EQ(buffer.push({0.03, stamp_sigma, 0.13, 0.19}), PushStatus::kStored);
  const Vector2<double> w(1, -1.0 / 3);
  for (const double l : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    InterpolatedPanTilt result;
    ASSERT_EQ(buffer.query(0.03 * l, frame_sigma, &result), QueryStatus::kOk);
    // PTCEE 25, except that the period's variance is shared by both stamps: 1/2 (1 - l)^2 + 1/2 l^2
    // of it belongs to the samples' own errors and 1/2 is taken out of the common one.
    const double period_variance = 1e-8;
    const double angle_part = ((1 - l) * (1 - l) + l * l) * 9e-10;
    const double time_part = frame_sigma * frame_sigma + stamp_sigma * stamp_sigma -
                             period_variance / 2 +
                             ((1 - l) * (1 - l) + l * l) * period_variance / 2;
    const Matrix2<double> expected =
        angle_part * Matrix2<double>::Identity() + time_part * w * w.transpose();
    EXPECT_LT((result.covariance.topLeftCorner<2, 2>() - expected).norm(), 1e-9 * expected.norm());
  }
}

// Times of samples on a constant acceleration, with a noise that is next to nothing.
template <std::size_t kCount>
std::array<TelemetryKnot, kCount> accelerated(const std::array<double, kCount>& times,
                                              double acceleration) {
  std::array<TelemetryKnot, kCount> knots{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const double t = times[i];
    knots[i] = {t, acceleration * t * t / 2, 0, 0, 0, false};
  }
  return knots;
}

// A mount that accelerates as expected misses the straight line by one standard deviation, in angle and rate
// together: between the two samples and beyond them.
TEST(TelemetryInterpolation, LineMissesTheExpectedAccelerationByItsCovariance) {
  constexpr double kAcceleration = 2;  // rad/s^2
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-9;
  noise.acceleration_sigma = kAcceleration;
  const auto knots = accelerated<2>({-0.03, 0.05}, kAcceleration);
  for (const double t : {-0.01, 0.02, 0.03, 0.07, 0.12}) {
    InterpolatedPanTilt out;
    ASSERT_TRUE(interpolate(noise, knots.data(), 2, 0, t, 0, Vector2<double>::Zero(), &out));
    const Vector2<double> error(kAcceleration * t * t / 2 - out.angle.pan,
                                kAcceleration * t - out.rate.pan);
    Matrix2<double> expected = error * error.transpose();
    // The samples could hide an acceleration that turns round between them.
    expected(1, 1) += std::pow(0.112 * 0.08 * kAcceleration, 2);
    Matrix2<double> claimed;
    claimed << out.covariance(0, 0), out.covariance(0, 2), out.covariance(2, 0),
        out.covariance(2, 2);
    // Rates of angles known to 1e-9 rad.
    EXPECT_LT((claimed - expected).norm(), 1e-4 * expected.norm()) << t;
    EXPECT_NEAR(claimed(0, 0), expected(0, 0), 1e-4 * expected(0, 0)) << t;
  }
}

// The acceleration begins, or turns round, anywhere between the samples: by the sum over a fine grid.
TEST(TelemetryInterpolation, CoversTheRateOfAnAccelerationThatBeginsBetweenSamples) {
  constexpr double kAcceleration = 2;  // rad/s^2
  constexpr double kPeriod_s = 0.1;
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-9;
  noise.acceleration_sigma = kAcceleration;
  for (const double before : {0.0, -kAcceleration}) {
    for (const double share : {0.0, 0.2, 0.5, 0.8, 1.0}) {
      double square = 0;
      constexpr int kSteps = 400;
      for (int i = 0; i < kSteps; ++i) {
        const double turn_s = kPeriod_s * (i + 0.5) / kSteps;
        const auto rate = [&](double t) {
          return before * std::min(t, turn_s) + kAcceleration * std::max(0.0, t - turn_s);
        };
        const double pan = before * turn_s * turn_s / 2 + before * turn_s * (kPeriod_s - turn_s) +
                           kAcceleration * std::pow(kPeriod_s - turn_s, 2) / 2;
        const std::array<TelemetryKnot, 2> knots = {
            {{0, 0, 0, 0, 0, false}, {kPeriod_s, pan, 0, 0, 0, false}}};
        InterpolatedPanTilt out;
        ASSERT_TRUE(interpolate(noise, knots.data(), 2, 0, share * kPeriod_s, 0,
                                Vector2<double>::Zero(), &out));
        square += std::pow(rate(share * kPeriod_s) - out.rate.pan, 2) / out.covariance(2, 2);
      }
      EXPECT_LT(square / kSteps, 1.02) << before << " " << share;
      EXPECT_GT(square / kSteps, 0.05) << before << " " << share;
    }
  }
}

// With it a cubic would be believed that misses all the others.
TEST(TelemetryInterpolation, ASampleOfUnknownTimeExcusesNoOther) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-4;
  std::array<TelemetryKnot, 8> knots{};
  for (int i = 0; i < 8; ++i) {
    const double t = 0.1 * (i - 3.5);
    // At rest, then in motion at once.
    knots[static_cast<std::size_t>(i)] = {t, std::max(0.0, 0.3 * t), 0, 0, 1e-7, false};
  }
  knots[4].own_variance = 0.013;
  InterpolatedPanTilt out;
  ASSERT_TRUE(interpolate(noise, knots.data(), 8, 4, 0.09, 0, Vector2<double>::Zero(), &out));
  EXPECT_EQ(out.samples, 2);
}

// Whichever neighbours the answer rests on, at uneven steps: they show the acceleration that is there.
// Where the mount turns round its rate is 0, and an error tau of the time asked for makes a tau^2 / 2: the variance is the
// mean square of that over a normal tau, by the sum over a fine grid.
TEST(TelemetryInterpolation, CountsWhatATimeErrorMakesWhereTheMountTurnsRound) {
  constexpr double kTimeSigma_s = 0.012;
  constexpr double kTurning_s = 1;
  const auto truth = [](double t) { return 0.1 * std::cos(2.5 * (t - kTurning_s)); };
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-5;
  noise.period_sigma_s = 1e-9;
  TelemetryBuffer<64> buffer(noise);
  for (int i = 0; i < 60; ++i) {
    const double t = i / 30.0;
    ASSERT_EQ(buffer.push({t, 1e-9, truth(t), -truth(t)}), PushStatus::kStored);
  }
  InterpolatedPanTilt result;
  ASSERT_TRUE(has_result(buffer.query(kTurning_s, kTimeSigma_s, &result)));
  double mean_square = 0;
  double weights = 0;
  for (double z = -8; z <= 8; z += 0.01) {
    const double error = truth(kTurning_s + z * kTimeSigma_s) - truth(kTurning_s);
    mean_square += std::exp(-z * z / 2) * error * error;
    weights += std::exp(-z * z / 2);
  }
  mean_square /= weights;
  EXPECT_NEAR(result.covariance(0, 0) / mean_square, 1, 0.02);
  EXPECT_NEAR(result.covariance(1, 1) / mean_square, 1, 0.02);
}

TEST(TelemetryInterpolation, FindsTheAccelerationThatItsSamplesShow) {
  constexpr double kAcceleration = 2;  // rad/s^2
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-9;
  noise.acceleration_sigma = 0;
  const auto square_of = [&](const auto& knots, int before, double t) {
    InterpolatedPanTilt out;
    EXPECT_TRUE(interpolate(noise, knots.data(), static_cast<int>(knots.size()), before, t, 0,
                            Vector2<double>::Zero(), &out));
    return out.acceleration_square.x();
  };
  const auto three = accelerated<3>({0.0, 0.03, 0.08}, kAcceleration);
  EXPECT_NEAR(square_of(three, 0, 0.01), kAcceleration * kAcceleration, 1e-3);
  EXPECT_NEAR(square_of(three, 1, 0.05), kAcceleration * kAcceleration, 1e-3);
  const auto eight = accelerated<8>({0.0, 0.03, 0.08, 0.1, 0.13, 0.18, 0.2, 0.23}, kAcceleration);
  EXPECT_NEAR(square_of(eight, 3, 0.11), kAcceleration * kAcceleration, 1e-3);
}

struct StampNoise {
  double sigma;         // of a stamp
  double period_sigma;  // of the time between two stamps
  double frame_sigma;
};

// One simulated look-up: a steady motion, `samples` samples of it at rate_hz with noise, and a query
// `beyond` seconds after the newest sample, or inside the samples if that is negative.
struct Trial {
  double rate_hz;
  double angle_sigma;
  StampNoise stamps;
  int samples;
  double beyond;
};

class SteadyTrial : public testing::TestWithParam<Trial> {};

TEST_P(SteadyTrial, CovarianceIsHonest) {
  const Trial trial = GetParam();
  TelemetryNoise noise;
  noise.pan_tilt_sigma = trial.angle_sigma;
  noise.period_sigma_s = trial.stamps.period_sigma;
  noise.acceleration_sigma = 0;
  const double own_sigma = trial.stamps.period_sigma / std::sqrt(2);
  // Raw stamps share nothing: rounding must not make that a negative number.
  const double shared_sigma =
      std::sqrt(std::max(0.0, trial.stamps.sigma * trial.stamps.sigma - own_sigma * own_sigma));
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  MeanNormalisedError all;
  MeanNormalisedError angles;
  MeanNormalisedError rates;
  const int runs = 3000;
  for (int run = 0; run < runs; ++run) {
    const PanTilt<double> start{4 * uniform(random), 4 * uniform(random)};
    const PanTilt<double> rate{0.05 * uniform(random), 0.05 * uniform(random)};
    const auto truth = [&](double t) {
      return PanTilt<double>{start.pan + rate.pan * t, start.tilt + rate.tilt * t};
    };
    TelemetryBuffer<32> buffer(noise);
    const double shared = shared_sigma * normal(random);
    double newest = 0;
    for (int i = 0; i < trial.samples; ++i) {
      const double time = i / trial.rate_hz;
      const PanTilt<double> angle = truth(time);
      newest = time + shared + own_sigma * normal(random);
      ASSERT_EQ(
          buffer.push({newest, trial.stamps.sigma, angle.pan + trial.angle_sigma * normal(random),
                       angle.tilt + trial.angle_sigma * normal(random)}),
          PushStatus::kStored);
    }
    const double last = (trial.samples - 1) / trial.rate_hz;
    const double time =
        trial.beyond < 0 ? last * (0.5 + 0.4 * uniform(random)) : newest - shared + trial.beyond;
    const double frame_error = trial.stamps.frame_sigma * normal(random);
    InterpolatedPanTilt result;
    ASSERT_TRUE(has_result(buffer.query(time + frame_error, trial.stamps.frame_sigma, &result)));
    const Vector4<double> error = error_of(result, truth(time), rate);
    all.add<4>(error, result.covariance);
    angles.add<2>(error.head<2>(), result.covariance.topLeftCorner<2, 2>());
    rates.add<2>(error.tail<2>(), result.covariance.bottomRightCorner<2, 2>());
  }
  // Curvature that noise feigns makes the covariance somewhat larger than the errors.
  const double excess = trial.samples == 2 ? 0 : 0.2;
  for (const MeanNormalisedError* error : {&all, &angles, &rates}) {
    EXPECT_LT(error->mean(), 1 + error->tolerance());
    EXPECT_GT(error->mean(), 1 - error->tolerance() - excess);
  }
}

constexpr StampNoise kExactStamps{0, 0, 0};
constexpr StampNoise kFilteredStamps{1e-3, 50e-6, 1e-3};
const StampNoise kRawStamps{1e-3, std::sqrt(2) * 1e-3, 0};

INSTANTIATE_TEST_SUITE_P(
    Telemetry, SteadyTrial,
    testing::Values(Trial{30, 3e-5, kExactStamps, 2, -1}, Trial{30, 3e-5, kFilteredStamps, 2, -1},
                    Trial{30, 3e-5, kRawStamps, 2, -1}, Trial{30, 3e-5, kFilteredStamps, 2, 0.05},
                    Trial{30, 3e-5, kFilteredStamps, 5, -1}, Trial{30, 3e-5, kExactStamps, 20, -1},
                    Trial{30, 3e-5, kFilteredStamps, 20, -1}, Trial{30, 3e-5, kRawStamps, 20, -1},
                    Trial{100, 1e-4, kFilteredStamps, 20, -1},
                    Trial{30, 1e-5, kFilteredStamps, 20, 0.001},
                    Trial{30, 3e-5, kFilteredStamps, 20, 0.05}));

// From rest to some ten quanta a sample.
TEST(TelemetryInterpolation, CountsTheRoundingOfTheDevice) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 0;
  noise.resolution = 2e-4;
  noise.period_sigma_s = 0;
  TelemetryLimits limits;
  limits.max_repeat_s = 0;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const double top_rate : {0.0, 4e-4, 8e-4, 1.6e-3, 3e-3, 6e-3, 0.1}) {
    double sum = 0;
    const int runs = 2000;
    for (int run = 0; run < runs; ++run) {
      TelemetryBuffer<32> buffer(noise, limits);
      const double start = uniform(random);
      const double rate = top_rate * uniform(random);
      for (int i = 0; i < 20; ++i) {
        const double pan =
            noise.resolution * std::round((start + rate * i / 30) / noise.resolution);
        ASSERT_EQ(buffer.push({i / 30.0, 0, pan, 0}), PushStatus::kStored);
      }
      const double time = (8 + 4 * uniform(random)) / 30;
      InterpolatedPanTilt result;
      ASSERT_EQ(buffer.query(time, 0, &result), QueryStatus::kOk);
      const double error = result.angle.pan - start - rate * time;
      sum += error * error / result.covariance(0, 0);
    }
    // Never less than the errors are, and not far more.
    EXPECT_LT(sum / runs, 1.1) << top_rate;
    EXPECT_GT(sum / runs, 0.4) << top_rate;
  }
}

// What the fit is for, and what it costs: the paper's path, its rates and its noise.
TEST(TelemetryInterpolation, IsBetterThanTheStraightLineOnThePapersPath) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 10);
  const double half_readout = 540 * 14.2e-6;
  for (const double rate_hz : {30.0, 50.0, 100.0}) {
    for (const double sigma : {1e-5, 1e-4}) {
      TelemetryNoise noise;
      noise.pan_tilt_sigma = sigma;
      noise.period_sigma_s = 0;
      MeanNormalisedError honest;
      double line_square = 0;
      double square = 0;
      double line_edge_square = 0;
      double edge_square = 0;
      const int runs = 3000;
      for (int run = 0; run < runs; ++run) {
        TelemetryBuffer<32> buffer(noise);
        const double start = uniform(random);
        std::array<PanTilt<double>, 20> measured;
        for (int i = 0; i < 20; ++i) {
          const PanTilt<double> angle = PaperPath::angle(start + i / rate_hz);
          PanTilt<double>& sample = measured[static_cast<std::size_t>(i)];
          sample = {angle.pan + sigma * normal(random), angle.tilt + sigma * normal(random)};
          ASSERT_EQ(buffer.push({i / rate_hz, 0, sample.pan, sample.tilt}), PushStatus::kStored);
        }
        const double l = uniform(random) / 10;
        InterpolatedPanTilt result;
        ASSERT_EQ(buffer.query((9 + l) / rate_hz, 0, &result), QueryStatus::kOk);
        const Vector2<double> line_rate = minus(measured[10], measured[9]) * rate_hz;
        const PanTilt<double> line = plus(measured[9], Vector2<double>(line_rate * l / rate_hz));

        const double time = start + (9 + l) / rate_hz;
        const PanTilt<double> truth = PaperPath::angle(time);
        const PanTilt<double> edge = PaperPath::angle(time + half_readout);
        honest.add<4>(error_of(result, truth, PaperPath::rate(time)), result.covariance);
        square += minus(result.angle, truth).squaredNorm();
        line_square += minus(line, truth).squaredNorm();
        edge_square +=
            (minus(result.angle, edge) + half_readout * result.rate.vector()).squaredNorm();
        line_edge_square += (minus(line, edge) + half_readout * line_rate).squaredNorm();
      }
      EXPECT_LT(std::sqrt(square / line_square), 0.8) << rate_hz << " Hz, " << sigma;
      EXPECT_LT(std::sqrt(edge_square / line_edge_square), 0.8) << rate_hz << " Hz, " << sigma;
      EXPECT_NEAR(honest.mean(), 1, honest.tolerance() + 0.1) << rate_hz << " Hz, " << sigma;
    }
  }
}

// The mount starts, runs and stops again with an acceleration that the samples cannot resolve.
TEST(TelemetryInterpolation, OwnsUpToTheErrorsOfAJerk) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const double acceleration = 1;
  const double top_rate = 0.3;
  const double ramp = top_rate / acceleration;
  // Starts at 0.
  const auto truth = [&](double t) {
    if (t < 0) return PanTilt<double>{0, 0};
    const double pan = t < ramp ? acceleration * t * t / 2
                                : acceleration * ramp * ramp / 2 + top_rate * (t - ramp);
    return PanTilt<double>{pan, -pan};
  };
  for (const double rate_hz : {30.0, 100.0}) {
    for (const double sigma : {1e-5, 1e-4}) {
      TelemetryNoise noise;
      noise.pan_tilt_sigma = sigma;
      noise.period_sigma_s = 0;
      double sum = 0;
      const int runs = 3000;
      for (int run = 0; run < runs; ++run) {
        TelemetryBuffer<128> buffer(noise);
        const double phase = uniform(random) / rate_hz;
        for (double t = phase - 0.5; t < 1; t += 1 / rate_hz) {
          const PanTilt<double> angle = truth(t);
          ASSERT_EQ(buffer.push({t, 0, angle.pan + sigma * normal(random),
                                 angle.tilt + sigma * normal(random)}),
                    PushStatus::kStored);
        }
        const double time = -0.2 + 0.7 * uniform(random);
        InterpolatedPanTilt result;
        ASSERT_EQ(buffer.query(time, 0, &result), QueryStatus::kOk);
        const Vector2<double> error = minus(result.angle, truth(time));
        sum += error.dot(result.covariance.topLeftCorner<2, 2>().ldlt().solve(error)) / 2;
      }
      EXPECT_LT(sum / runs, 2) << rate_hz << " Hz, " << sigma;
    }
  }
}

// Beyond the newest sample nobody has seen the mount: what it did in the seconds before is what it may do.
// Errors of pan and tilt in standard deviations, at all times from the newest sample on to 80 ms after it.
struct Extrapolation {
  double mean_square = 0;
  double largest = 0;
};

template <typename Truth>
Extrapolation extrapolate(double rate_hz, double sigma, double from_s, double to_s,
                          const Truth& truth) {
  constexpr double kBeyond = 0.08;  // s
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  TelemetryNoise noise;
  noise.pan_tilt_sigma = sigma;
  noise.period_sigma_s = 0;
  TelemetryBuffer<1024> buffer(noise);
  Extrapolation out;
  int count = 0;
  for (int i = 0; i < to_s * rate_hz; ++i) {
    const double time = i / rate_hz;
    const PanTilt<double> angle = truth(time);
    EXPECT_EQ(buffer.push({time, 0, angle.pan + sigma * normal(random),
                           angle.tilt + sigma * normal(random)}),
              PushStatus::kStored);
    if (time < from_s) continue;
    for (const double beyond : {0.25 * kBeyond, 0.5 * kBeyond, 0.75 * kBeyond, kBeyond}) {
      InterpolatedPanTilt result;
      EXPECT_EQ(buffer.query(time + beyond, 0, &result), QueryStatus::kExtrapolated);
      EXPECT_TRUE(result.extrapolated);
      const Vector2<double> sigmas =
          minus(result.angle, truth(time + beyond))
              .cwiseQuotient(result.covariance.diagonal().head<2>().cwiseSqrt());
      out.mean_square += sigmas.squaredNorm() / 2;
      out.largest = std::max(out.largest, sigmas.cwiseAbs().maxCoeff());
      ++count;
    }
  }
  out.mean_square /= count;
  return out;
}

// The paper's path with the fields of view of three cameras, at the paper's speed and twice that.
TEST(TelemetryInterpolation, LearnsFromAFastMountWhatToExpectBeyondTheNewestSample) {
  for (const double field : {0.06, 0.35, 0.87}) {
    for (const double period : {10.0, 5.0}) {
      const auto truth = [&](double t) {
        const double angle = 2 * kPi * t / period;
        const double scale = field / (2 * kPi);
        return PanTilt<double>{9 * scale * std::sin(angle), -3 * scale * std::cos(3 * angle)};
      };
      for (const double rate_hz : {20.0, 50.0}) {
        for (const double sigma : {1e-5, 1e-4}) {
          SCOPED_TRACE(testing::Message()
                       << field << " rad, " << period << " s, " << rate_hz << " Hz, " << sigma);
          const Extrapolation e = extrapolate(rate_hz, sigma, 3, 3 + 2 * period, truth);
          // Peaks of a sine stand sqrt(2) above its mean square, the fourth root of its mean fourth power
          // is 1.11 times that; the floor is more than the slowest does.
          EXPECT_LT(e.mean_square, 1.1);
          EXPECT_GT(e.mean_square, field < 0.1 ? 0.1 : 0.4);
          EXPECT_LT(e.largest, 5);
        }
      }
    }
  }
}

// What a mount does now counts, and not what it did five seconds ago: it is expected to be able to come to rest within
// a second from the rate it has.
TEST(ExpectedAcceleration, IsWhatBringsTheLatestRateToRest) {
  constexpr double kRate = 0.2;           // rad/s
  constexpr double kAcceleration = 0.05;  // rad/s^2: four seconds from one to the other
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-6;
  noise.acceleration_sigma = 1e-3;
  for (const bool starts : {true, false}) {
    ExpectedAcceleration expected(noise, 0.1);
    for (int i = 0; i < 50; ++i) {
      const double ago_s = 0.1 * i;
      const double from_newest = kRate * ago_s - kAcceleration * ago_s * ago_s / 2;
      const double ramped = ago_s < 4 ? from_newest : kRate * 4 - kAcceleration * 8;
      const double from_rest = kAcceleration * std::min(ago_s, 4.0) * std::min(ago_s, 4.0) / 2 +
                               kRate * std::max(ago_s - 4, 0.0);
      const double pan = starts ? -ramped : -from_rest;
      expected.add({100 - ago_s, pan, 0, 0, 0, false});
    }
    const double square = expected.square().x();
    if (starts) {
      EXPECT_GT(square, 0.9 * kRate * kRate);
    } else {
      EXPECT_LT(square, 2 * kAcceleration * kAcceleration);
    }
    EXPECT_LT(expected.square().y(), 1e-5);
  }
}

// The faster the mount turns, the more acceleration a stamp feigns that is off.
TEST(ExpectedAcceleration, DoesNotTakeErrorsOfStampsForAccelerations) {
  constexpr double kRate = 4;       // rad/s
  constexpr double kOwn = 1e-3;     // s, of each stamp
  constexpr double kPeriod = 0.02;  // s
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-9;
  ExpectedAcceleration expected(noise, kPeriod);
  for (int i = 0; i < 3; ++i) {
    const double ago_s = kPeriod * i;
    const double off_s = i == 1 ? kOwn : 0;
    expected.add({10 - ago_s + off_s, -kRate * ago_s, 0, 0, kOwn * kOwn, false});
  }
  EXPECT_NEAR(expected.square().x(), kRate * kRate, 1e-9) << "what brings it to rest, and no more";
}

// The error that neighbouring stamps share may be the larger one's whichever comes first.
TEST(TelemetryInterpolation, TakesTheLargerOfTwoSharedErrors) {
  TelemetryNoise noise;
  noise.acceleration_sigma = 0;
  constexpr double kRate = 0.5;  // rad/s
  const auto variance_with = [&](double first, double second) {
    const TelemetryKnot knots[] = {{1.0, 0, 0, first, 0, false},
                                   {1.1, 0.1 * kRate, 0, second, 0, false}};
    InterpolatedPanTilt out;
    EXPECT_TRUE(interpolate(noise, knots, 2, 0, 1.03, 0, Vector2<double>::Zero(), &out));
    return out.covariance(0, 0);
  };
  const double large = 1e-4;  // s^2
  const double small = 1e-6;
  EXPECT_EQ(variance_with(large, small), variance_with(small, large));
  EXPECT_EQ(variance_with(large, small), variance_with(large, large));
  EXPECT_NEAR(variance_with(large, small) - variance_with(0, 0), kRate * kRate * large, 1e-12);
}

// A mount that stops within a sample: the first time nobody could know, and then it is known. Errors in
// the 80 ms after a stop are no normal ones; before, they were up to 250 sigmas.
TEST(TelemetryInterpolation, RemembersThatTheMountStopsAtOnce) {
  constexpr double kRate = 0.3;  // rad/s
  constexpr double kMoves = 2;   // s
  constexpr double kRests = 1;   // s
  const auto truth = [&](double t) {
    const double round = std::floor(t / (kMoves + kRests));
    const double pan = kRate * (round * kMoves + std::min(t - round * (kMoves + kRests), kMoves));
    return PanTilt<double>{pan, -pan};
  };
  for (const double rate_hz : {20.0, 50.0}) {
    for (const double sigma : {1e-5, 1e-4}) {
      const Extrapolation e = extrapolate(rate_hz, sigma, kMoves + kRests + 1, 20, truth);
      EXPECT_LT(e.mean_square, 3) << rate_hz << " Hz, " << sigma;
      EXPECT_LT(e.largest, 20) << rate_hz << " Hz, " << sigma;
    }
  }
}

// Whatever a mean over a long time is made of, white samples h apart leave sigma^2 h / T in it: so must the
// answers, each worth its correlation time.
TEST(TelemetryInterpolation, AnAnswerIsWorthItsCorrelationTime) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  const double sigma = 3e-5;
  TelemetryNoise noise;
  noise.pan_tilt_sigma = sigma;
  noise.period_sigma_s = 0;
  noise.acceleration_sigma = 0;
  for (const double rate_hz : {30.0, 100.0}) {
    double mean_square = 0;
    double expected = 0;
    const int runs = 400;
    const int kSamples = 120;
    for (int run = 0; run < runs; ++run) {
      TelemetryBuffer<256> buffer(noise);
      for (int i = 0; i < kSamples; ++i) {
        const double time = i / rate_hz;
        ASSERT_EQ(buffer.push({time, 0, 0.1 * time + sigma * normal(random),
                               -0.2 * time + sigma * normal(random)}),
                  PushStatus::kStored);
      }
      // Away from the ends, whose windows are lopsided.
      const double from = 10 / rate_hz;
      const double to = (kSamples - 11) / rate_hz;
      const int queries = 4 * (kSamples - 21);
      Vector2<double> mean = Vector2<double>::Zero();
      double worth = 0;
      int white = 0;
      for (int i = 0; i < queries; ++i) {
        const double time = from + (to - from) * (i + 0.5) / queries;
        InterpolatedPanTilt result;
        ASSERT_EQ(buffer.query(time, 0, &result), QueryStatus::kOk);
        mean += Vector2<double>(result.angle.pan - 0.1 * time, result.angle.tilt + 0.2 * time) /
                queries;
        ASSERT_GT(result.correlation_time_s, 0.9 / rate_hz);
        ASSERT_LE(result.correlation_time_s, 1);
        // Where noise feigns an acceleration the answer is worth less, rightly or not.
        if (result.acceleration_square.norm() > 0) continue;
        ASSERT_LT(result.correlation_time_s, 8.1 / rate_hz);
        worth += result.covariance(0, 0) * result.correlation_time_s;
        ++white;
      }
      mean_square += mean.squaredNorm() / 2 / runs;
      ASSERT_GT(white, queries / 2);
      expected += worth / white / (to - from) / runs;
    }
    // Four standard deviations of a mean of squares, and the ends, a hundredth; the covariance holds
    // curvature besides, which noise feigns.
    const double tolerance = 4 * std::sqrt(2.0 / (2 * runs)) + 0.01;
    EXPECT_NEAR(mean_square / (sigma * sigma / rate_hz / ((kSamples - 21) / rate_hz)), 1,
                tolerance);
    EXPECT_LT(mean_square, (1 + tolerance) * expected);
    EXPECT_GT(mean_square, (1 - tolerance - 0.2) * expected);
  }
}

TEST(TelemetryInterpolation, TwoSamplesAreWorthOneAtASampleAndTwoBetween) {
  TelemetryNoise noise;
  noise.period_sigma_s = 0;
  noise.acceleration_sigma = 0;
  TelemetryBuffer<8> buffer(noise);
  ASSERT_EQ(buffer.push({1, 0, 0, 0}), PushStatus::kStored);
  ASSERT_EQ(buffer.push({1.04, 0, 0.001, 0.002}), PushStatus::kStored);
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1.02, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.samples, 2);
  EXPECT_NEAR(result.correlation_time_s, 0.08, 1e-9);
  ASSERT_EQ(buffer.query(1.04, 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.correlation_time_s, 0.04, 1e-9);
}

TEST(TelemetryInterpolation, WhatClockAndAccelerationDoStaysAlikeForLong) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-6;
  noise.acceleration_sigma = 10;
  TelemetryBuffer<8> buffer(noise);
  ASSERT_EQ(buffer.push({1, 0, 0, 0}), PushStatus::kStored);
  ASSERT_EQ(buffer.push({1.04, 0, 0.001, 0.002}), PushStatus::kStored);
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1.1, 0, &result), QueryStatus::kExtrapolated);
  EXPECT_NEAR(result.correlation_time_s, 1, 0.01);
  noise.acceleration_sigma = 0;
  TelemetryBuffer<8> late(noise);
  ASSERT_EQ(late.push({1, 0, 0, 0}), PushStatus::kStored);
  ASSERT_EQ(late.push({1.04, 0, 0.1, 0.2}), PushStatus::kStored);
  ASSERT_EQ(late.query(1.02, 1e-2, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.correlation_time_s, 1, 0.01);
}

}  // namespace
}  // namespace alidade

// If a head's telemetry errs by angle, the map's offset is known as well as it can be, and no
// better.

#include "core/realtime/oe_mode/offset_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/realtime/oe_mode/map_offset_filter.h"

namespace alidade::test {
namespace {

// A gear: a sine of the true angle, another in tilt.
struct CellsGear {
  double amplitude = 0;  // rad
  double phase = 0;
  [[nodiscard]] Vector2<double> at(const Vector2<double>& angle) const {
    return {amplitude * std::sin(60 * angle.x() + phase),
            amplitude * std::sin(72 * angle.y() - 2 * phase)};
  }
};

Vector2<double> swept_angle(double time_s, double range) {
  return {range * std::sin(0.5 * time_s), 0.6 * range * std::sin(0.31 * time_s + 1)};
}

// An observed head with white noise and an error of its angles, seen 25 times a second. told: sigma
// of that error, as the calibration has it.
class SeenHead {
 public:
  SeenHead(std::uint64_t seed, double amplitude, double told, double noise = 2e-5)
      : random_(seed), noise_(noise), told_(told) {
    std::uniform_real_distribution<double> phase(0, 2 * kPi);
    gear_ = {amplitude, phase(random_)};
    filter_.reset();
  }

  // Telemetry against landmarks at this angle. The first places the map.
  void see(double time_s, const Vector2<double>& angle) {
    std::normal_distribution<double> normal(0, noise_);
    const double pan = normal(random_);
    const Vector2<double> error = gear_.at(angle) + Vector2<double>(pan, normal(random_));
    InterpolatedPanTilt telemetry;
    telemetry.angle = {angle.x(), angle.y()};
    telemetry.error_variance.setConstant(told_ * told_);
    telemetry.error_length.setConstant(told_ > 0 ? 1.0 / 60 : 0);
    telemetry.covariance.diagonal().setConstant(noise_ * noise_ + told_ * told_);
    filter_.widen(Calibration{}, &telemetry);
    const AngleError of_angle = angle_error(Mechanics<double>{}, telemetry);
    const Matrix2<double> covariance = telemetry.covariance.topLeftCorner<2, 2>();
    if (!begun_) {
      // The map lies where telemetry says: its offset, base minus map, is what telemetry errs by.
      truth_ = -error;
      filter_.begin(time_s, covariance, false, of_angle);
      begun_ = true;
      return;
    }
    OffsetInnovation innovation;
    innovation.value = error + truth_ - filter_.offset().value;
    innovation.covariance = covariance;
    innovation.covariance.diagonal() -= of_angle.variance;
    innovation.error = of_angle;
    rejected_ += filter_.learn(time_s, innovation) ? 0 : 1;
  }

  // Squares of the offset's error over its variance, mean of both axes.
  [[nodiscard]] double normalised_square() const {
    const Vector2<double> error = filter_.offset().value - truth_;
    const Vector2<double> variance = filter_.offset().covariance.diagonal();
    return error.cwiseAbs2().cwiseQuotient(variance).mean();
  }
  [[nodiscard]] double error() const { return (filter_.offset().value - truth_).norm(); }
  [[nodiscard]] double sigma() const {
    return std::sqrt(filter_.offset().covariance.diagonal().mean());
  }
  [[nodiscard]] const MapOffsetFilter& filter() const { return filter_; }
  [[nodiscard]] int rejected() const { return rejected_; }

 private:
  std::mt19937_64 random_;
  double noise_;
  double told_;
  CellsGear gear_;
  MapOffsetFilter filter_{MapOffsetOptions{}};
  Vector2<double> truth_ = Vector2<double>::Zero();
  bool begun_ = false;
  int rejected_ = 0;
};

// Of the offset over frames and seeds.
struct OffsetTally {
  double normalised = 0;  // sum of error^2 / sigma^2
  double worst = 0;
  double square = 0;    // rad^2
  double variance = 0;  // rad^2
  int frames = 0;

  void add(const SeenHead& head) {
    normalised += head.normalised_square();
    worst = std::max(worst, head.normalised_square());
    square += head.error() * head.error() / 2;
    variance += head.sigma() * head.sigma();
    ++frames;
  }
};

constexpr std::uint64_t kHeadSeeds = 40;

// Two axes and 40 seeds: the mean of error^2 / sigma^2 of one place is 1 +- 0.16, and less where
// whole periods of the gear average better than chance.
TEST(OffsetCells, AreHonestAboutAnErrorThatWasTold) {
  constexpr double kAmplitude = 2e-4;
  double sigma_at_one_place = 0;
  for (const double range : {0.002, 0.05, 0.2}) {
    OffsetTally tally;
    for (std::uint64_t seed = 0; seed < kHeadSeeds; ++seed) {
      SeenHead head(seed, kAmplitude, kAmplitude / std::sqrt(2));
      for (int i = 0; i < 500; ++i) {
        head.see(0.04 * i, swept_angle(0.04 * i, range));
        tally.add(head);
      }
      EXPECT_EQ(head.rejected(), 0);
    }
    EXPECT_LT(tally.normalised / tally.frames, 1.5) << range;
    EXPECT_GT(tally.normalised / tally.frames, 0.1) << range;
    EXPECT_LT(tally.worst, 16) << range;
    EXPECT_LT(tally.variance, 9 * tally.square) << range;
    const double sigma = std::sqrt(tally.variance / tally.frames);
    if (range == 0.002) {
      sigma_at_one_place = sigma;
      EXPECT_NEAR(sigma, kAmplitude / std::sqrt(2), 0.05 * kAmplitude);
    }
    if (range == 0.2) {
      EXPECT_LT(sigma, 0.7 * sigma_at_one_place);
    }
  }
}

// However long a camera looks at one place, telemetry's error there stays.
TEST(OffsetCells, KnowTheOffsetNoBetterThanIndependentLengthsAllow) {
  constexpr double kTold = 1e-4;
  SeenHead head(1, 0, kTold);
  for (int i = 0; i < 5000; ++i) head.see(0.04 * i, {0.3, -0.2});
  EXPECT_GT(head.sigma(), 0.99 * kTold);
  // There and elsewhere, far apart: two lengths.
  for (int i = 0; i < 5000; ++i) head.see(200 + 0.04 * i, {1.3, 0.4});
  EXPECT_NEAR(head.sigma(), kTold / std::sqrt(2), 0.03 * kTold);
}

// Nobody told: after two seconds of movement the cells have shown it.
TEST(OffsetCells, LearnAnErrorThatNobodyTold) {
  for (const double amplitude : {2e-4, 5e-5}) {
    OffsetTally tally;
    int rejected = 0;
    for (std::uint64_t seed = 0; seed < kHeadSeeds; ++seed) {
      SeenHead head(seed, amplitude, 0);
      for (int i = 0; i < 500; ++i) {
        head.see(0.04 * i, swept_angle(0.04 * i, 0.12));
        if (i >= 50) tally.add(head);
      }
      rejected += head.rejected();
    }
    EXPECT_LT(tally.normalised / tally.frames, 1.5) << amplitude;
    EXPECT_GT(tally.normalised / tally.frames, 0.1) << amplitude;
    EXPECT_LT(tally.worst, 16) << amplitude;
    EXPECT_LT(tally.variance, 9 * tally.square) << amplitude;
    EXPECT_LT(rejected, 13 * static_cast<int>(kHeadSeeds)) << "half a second's";
  }
}

// The gate is for one in 10^4.
TEST(OffsetCells, LearnNothingFromAHeadThatHasNoSuchError) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SeenHead head(seed, 0, 0);
    for (int i = 0; i < 500; ++i) head.see(0.04 * i, swept_angle(0.04 * i, 0.2));
    EXPECT_FALSE(head.filter().has_learnt_error()) << seed;
  }
}

// The parameters' errors scatter the cells, too: they are expected, and no error of the angle.
TEST(OffsetCells, DoNotTakeTheCalibrationsErrorForTheGears) {
  constexpr double kNoise = 1e-5;
  for (const bool expected : {true, false}) {
    OffsetAxisCells cells;
    for (int i = 0; i < 200; ++i) {
      const double angle = 0.001 * i;
      const double off = 1e-4 * std::sin(60 * angle);
      cells.add({angle, off, kNoise * kNoise, 0, 0, expected ? off * off + 1e-9 : 0, 0.0}, 0);
    }
    EXPECT_EQ(cells.scatter().variance > 0, !expected);
  }
}

// A slope is a wrong focal length or scale. It shall contradict, and not be taken for a gear.
TEST(OffsetCells, DoNotLearnASlope) {
  OffsetAxisCells cells;
  for (int i = 0; i < 400; ++i) {
    const double angle = 3 + 0.001 * i;  // across the wrap
    cells.add({angle, 1e-3 * i * 0.001 + 2e-3, 1e-10, 0, 0, 0, 0.0}, 0);
  }
  EXPECT_EQ(cells.scatter().variance, 0);
}

TEST(OffsetCells, LearnTheAmplitudeAndTheLength) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1e-5);
  OffsetAxisCells cells;
  for (int i = 0; i < 4000; ++i) {
    const double angle = -1 + 0.0005 * i;
    cells.add({angle, 3e-3 + 2e-4 * std::sin(40 * angle) + normal(random), 1e-10, 0, 0, 0, 0.0}, 0);
  }
  const OffsetAxisCells::Scatter error = cells.scatter();
  EXPECT_NEAR(std::sqrt(error.variance), 2e-4 / std::sqrt(2), 0.1 * 2e-4);
  EXPECT_NEAR(error.length, 1.0 / 40, 0.2 / 40);
}

TEST(OffsetCells, AreAsNewAfterAReset) {
  SeenHead head(1, 2e-4, 0);
  for (int i = 0; i < 500; ++i) head.see(0.04 * i, swept_angle(0.04 * i, 0.2));
  MapOffsetFilter filter = head.filter();
  ASSERT_TRUE(filter.has_learnt_error());
  filter.reset();
  EXPECT_TRUE(filter.has_learnt_error()) << "the head is the same";
  filter.forget_error();
  EXPECT_FALSE(filter.has_learnt_error());
  InterpolatedPanTilt telemetry;
  filter.widen(Calibration{}, &telemetry);
  EXPECT_EQ(telemetry.covariance.norm(), 0);
}

}  // namespace
}  // namespace alidade::test

// How much neighbours share is learnt from frames whose landmarks err by a smooth random field, as
// haze does, besides noise of their own; and from frames with that noise alone.

#include "core/realtime/oe_mode/error_sharing.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

namespace alidade::test {
namespace {

constexpr double kSharedWidth = 1920;
constexpr double kSharedHeight = 1080;
constexpr double kSharedFocal = 8000;       // px
constexpr double kSharedLineDelay = 20e-6;  // s
constexpr double kOwnNoise = 0.1;           // px
constexpr int kSharedLandmarks = 180;

// Angle, rate and acceleration are all 0.
class HazyFrames {
 public:
  // field_px: each component's standard deviation; length_px: the field's.
  HazyFrames(double field_px, double length_px) : field_px_(field_px), length_px_(length_px) {}

  // Solves one frame. Returns the normalised square of the error, 6 degrees of freedom.
  double add(ErrorSharing* sharing) {
    struct Wave {
      double u, v, phase;
      Vector2<double> amplitude;
    };
    constexpr int kSharedWaves = 24;
    std::vector<Wave> waves;
    for (int i = 0; i < kSharedWaves; ++i) {
      const double amplitude = field_px_ * std::sqrt(2.0 / kSharedWaves);
      waves.push_back({normal(1 / length_px_),
                       normal(1 / length_px_),
                       uniform(2 * kPi),
                       {normal(amplitude), normal(amplitude)}});
    }
    std::vector<FoundLandmark> landmarks(kSharedLandmarks);
    for (FoundLandmark& landmark : landmarks) {
      landmark.u.x() = uniform(kSharedWidth);
      landmark.u.y() = uniform(kSharedHeight);
      landmark.J_angle = kSharedFocal * Matrix2<double>::Identity();
      landmark.time_s = kSharedLineDelay * (landmark.u.y() - kSharedHeight / 2);
      landmark.covariance = kOwnNoise * kOwnNoise * Matrix2<double>::Identity();
      landmark.shared_covariance.setZero();
      landmark.residual.x() = normal(kOwnNoise);
      landmark.residual.y() = normal(kOwnNoise);
      for (const Wave& wave : waves) {
        landmark.residual += wave.amplitude * std::sin(wave.u * landmark.u.x() +
                                                       wave.v * landmark.u.y() + wave.phase);
      }
    }
    MotionPrior prior;
    prior.motion_information.diagonal().tail<2>().setConstant(1);  // 1 rad/s^2
    prior.sharing = sharing->factor();
    SolvedMotion solved;
    EXPECT_EQ(solve_orientation(landmarks.data(), kSharedLandmarks, prior, {}, kSharedWidth,
                                kSharedHeight, kSharedLineDelay * kSharedHeight / 2, &solved),
              SolveStatus::kOk);
    sharing->note(solved.single_squares, solved.large_squares, solved.large_averages);
    // Units alike, for the solution.
    const Vector6 D = solved.frame_covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6 correlation = D.asDiagonal() * solved.frame_covariance * D.asDiagonal();
    const Vector6 error = D.cwiseProduct(solved.correction);
    return error.dot(correlation.ldlt().solve(error));
  }

 private:
  double normal(double sigma) { return sigma * std::normal_distribution<double>()(random_); }
  double uniform(double to) { return std::uniform_real_distribution<double>(0, to)(random_); }

  double field_px_, length_px_;
  std::mt19937_64 random_{1};
};

// Mean of the normalised squares per degree of freedom, once the factor is known.
double mean_square(HazyFrames* frames, ErrorSharing* sharing) {
  constexpr int kUntilKnown = 64;
  constexpr int kJudgedFrames = 400;
  double sum = 0;
  for (int i = 0; i < kUntilKnown + kJudgedFrames; ++i) {
    const double square = frames->add(sharing);
    if (i >= kUntilKnown) sum += square / 6;
  }
  return sum / kJudgedFrames;
}

// 400 frames, 6 degrees each: four standard deviations of the mean square are 0.12.
TEST(ErrorSharing, LeavesIndependentErrorsAlone) {
  HazyFrames frames(0, 150);
  ErrorSharing sharing;
  const double square = mean_square(&frames, &sharing);
  // The memory holds 64 * 6 degrees of freedom: the factor's standard deviation is 7 %.
  EXPECT_LT(sharing.factor(), 1.28);
  // The inflation is the larger of two estimates, and the factor is at least 1: some 10 % each.
  EXPECT_GT(square, 0.75);
  EXPECT_LT(square, 1.12);
}

// A field three times the noise, in phase over 8 % or 13 % of the width.
TEST(ErrorSharing, MakesFramesHonestWhereNeighboursErrTogether) {
  for (const double length_px : {150.0, 250.0}) {
    HazyFrames frames(0.3, length_px);
    ErrorSharing sharing;
    const double square = mean_square(&frames, &sharing);
    EXPECT_GT(square, 0.4) << length_px;
    EXPECT_LT(square, 1.5) << length_px;
    // Without it the same frames claim far too much.
    HazyFrames again(0.3, length_px);
    double blind = 0;
    for (int i = 0; i < 100; ++i) {
      ErrorSharing unlearnt;
      blind += again.add(&unlearnt) / 600;
    }
    EXPECT_GT(blind, 2 * square) << length_px;
  }
}

TEST(ErrorSharing, ForgetsAHazeThatIsOver) {
  ErrorSharing sharing;
  HazyFrames hazy(0.3, 250);
  for (int i = 0; i < 64; ++i) hazy.add(&sharing);
  EXPECT_GT(sharing.factor(), 2);
  HazyFrames clear(0, 250);
  for (int i = 0; i < 400; ++i) clear.add(&sharing);
  EXPECT_LT(sharing.factor(), 1.3);
  sharing.reset();
  EXPECT_EQ(sharing.factor(), 1);
}

// Nothing is learnt from frames with too few landmarks.
TEST(ErrorSharing, NeedsFreedom) {
  ErrorSharing sharing;
  sharing.note({50, 100}, {1e3, 0}, {});
  sharing.note({50, -2}, {1e3, 6}, {});
  EXPECT_EQ(sharing.factor(), 1);
}

}  // namespace
}  // namespace alidade::test

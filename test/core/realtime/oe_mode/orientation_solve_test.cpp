// The solution's errors against its covariance, with landmarks simulated from what they claim: with
// and without telemetry, with wrong landmarks, with claims that do not hold.

#include "core/realtime/oe_mode/orientation_solve.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade::test {
namespace {

constexpr double kSolvedWidth = 1920;
constexpr double kSolvedHeight = 1080;
constexpr double kSolvedFocal = 8000;  // px
constexpr double kNoise = 0.1;         // px, of a landmark, about
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kPriorAccelerationSigma = 2;  // rad/s^2, of the prior

struct World {
  double line_delay = 20e-6;  // s/row
  int landmarks = 120;
  bool has_telemetry = true;
  double telemetry_angle = 3e-5;  // rad
  double telemetry_rate = 1e-3;   // rad/s
  double offset = 2e-5;           // rad, one standard deviation of g
  double shared = 0;              // rad, of the landmarks' common error
  double understated = 1;         // errors are so many times what is claimed
  double edges = 0;               // share of landmarks that see one direction only

  [[nodiscard]] double half_readout_s() const { return line_delay * kSolvedHeight / 2; }
};

// One frame: the truth is drawn, then what is seen of it.
struct Frame {
  Vector6 x;          // angle, rate, acceleration, map's frame
  Vector2<double> g;  // the landmarks' common error included
  std::vector<FoundLandmark> landmarks;
  MotionPrior prior;

  SolveStatus solve(const World& world, SolvedMotion* out, const SolveLimits& limits = {}) {
    return solve_orientation(landmarks.data(), static_cast<int>(landmarks.size()), prior, limits,
                             kSolvedWidth, kSolvedHeight, world.half_readout_s(), out);
  }
};

class Simulation {
 public:
  explicit Simulation(std::uint64_t seed) : random_(seed) {}

  [[nodiscard]] double normal(double sigma) {
    return sigma * std::normal_distribution<double>()(random_);
  }
  [[nodiscard]] double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  // Positions all over the image, Jacobians of a camera at a tilt, covariances of all shapes.
  [[nodiscard]] FoundLandmark landmark(const World& world, const Vector2<double>& u) {
    Calibration calibration;
    calibration.camera = {
        kSolvedFocal, 1, {0.5}, static_cast<int>(kSolvedWidth), static_cast<int>(kSolvedHeight)};
    calibration.line_delay = world.line_delay;
    const FrameMotion<double> motion{{0.3, -0.4}, {0.1, 0.05}, kSolvedHeight / 2};
    Vector3<double> d;
    SeenDirection seen;
    EXPECT_EQ(rolling_shutter_unproject(calibration.camera, calibration.mechanics,
                                        calibration.line_delay, motion, u, &d),
              ProjectionStatus::kOk);
    EXPECT_TRUE(ViewProjection(calibration, motion).project(d, &seen));
    FoundLandmark found{};
    found.u = seen.u;
    found.J_angle = seen.J_angle;
    found.time_s = seen.time_s;
    const double turn = uniform(0, kPi);
    const Vector2<double> along(std::cos(turn), std::sin(turn));
    const Vector2<double> across(-along.y(), along.x());
    const bool edge = uniform(0, 1) < world.edges;
    const double sharp = kNoise * uniform(0.5, 1.5);
    const double blunt = edge ? 10 : kNoise * uniform(0.5, 1.5);
    found.covariance =
        sharp * sharp * across * across.transpose() + blunt * blunt * along * along.transpose();
    found.shared_covariance = world.shared * world.shared * Matrix2<double>::Identity();
    // Along an edge a patch stays where it was.
    found.residual = (edge ? 0 : normal(world.understated * blunt)) * along +
                     normal(world.understated * sharp) * across;
    if (edge) found.residual -= along * along.dot(seen_shift(found));
    return found;
  }

  [[nodiscard]] Frame frame(const World& world) {
    std::vector<Vector2<double>> positions;
    for (int i = 0; i < world.landmarks; ++i) {
      const double u = uniform(0, kSolvedWidth);
      positions.emplace_back(u, uniform(0, kSolvedHeight));
    }
    return frame(world, positions);
  }

  [[nodiscard]] Frame frame(const World& world, const std::vector<Vector2<double>>& positions) {
    Frame out;
    const double far = 2 / kSolvedFocal;
    out.x << uniform(-far, far), uniform(-far, far), normal(0.01), normal(0.01),
        normal(kPriorAccelerationSigma), normal(kPriorAccelerationSigma);
    x_ = out.x;
    for (int i = 0; i < 2; ++i) out.g[i] = normal(world.offset) + normal(world.shared);
    for (const Vector2<double>& u : positions) {
      out.landmarks.push_back(landmark(world, u));
      FoundLandmark& found = out.landmarks.back();
      found.residual += seen_shift(found);
    }
    out.prior.motion_information.diagonal().tail<2>().setConstant(
        1 / (kPriorAccelerationSigma * kPriorAccelerationSigma));
    out.prior.offset_covariance = world.offset * world.offset * Matrix2<double>::Identity();
    out.prior.has_telemetry = world.has_telemetry;
    if (world.has_telemetry) measure(world, &out);
    return out;
  }

  void measure(const World& world, Frame* frame) {
    frame->prior.telemetry = frame->x.head<4>();
    frame->prior.telemetry.head<2>() += frame->g;
    const Vector4<double> sigma(world.telemetry_angle, world.telemetry_angle, world.telemetry_rate,
                                world.telemetry_rate);
    for (int i = 0; i < 4; ++i) frame->prior.telemetry[i] += normal(sigma[i]);
    frame->prior.telemetry_covariance = sigma.cwiseAbs2().asDiagonal();
  }

 private:
  [[nodiscard]] Vector2<double> seen_shift(const FoundLandmark& found) const {
    const double t = found.time_s;
    return found.J_angle *
           (x_.head<2>() + t * x_.segment<2>(2) + 0.5 * t * t * x_.tail<2>()).eval();
  }

  std::mt19937_64 random_;
  Vector6 x_ = Vector6::Zero();
};

// Errors of base angle, rate and acceleration; without telemetry of the map's.
Vector6 error_of(const Frame& frame, const SolvedMotion& solved) {
  Vector6 error = solved.correction - frame.x;
  error.head<2>() += solved.offset_correction - frame.g;
  return error;
}

double normalised(const Vector6& error, const Matrix6& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

struct Score {
  int runs = 0;
  int inliers = 0;
  double squares = 0;           // normalised, 6 degrees of freedom
  double squares_as_drawn = 0;  // ... by the covariance before inflation, about
  double inflation = 0;
  Vector6 bias = Vector6::Zero();  // mean of errors in standard deviations

  void add(const Frame& frame, const SolvedMotion& solved) {
    const Vector6 error = error_of(frame, solved);
    const double square = normalised(error, solved.covariance);
    ++runs;
    inliers += solved.inliers;
    squares += square;
    squares_as_drawn += solved.inflation * square;
    inflation += solved.inflation;
    bias += error.cwiseQuotient(solved.covariance.diagonal().cwiseSqrt());
  }

  [[nodiscard]] double mean() const { return squares / runs; }
  [[nodiscard]] double mean_as_drawn() const { return squares_as_drawn / runs; }
  [[nodiscard]] double mean_inflation() const { return inflation / runs; }
  // Four standard deviations of the mean of so many chi-squares of 6 degrees.
  [[nodiscard]] double tolerance() const { return 4 * std::sqrt(12.0 / runs); }
  [[nodiscard]] double worst_bias() const {
    return (bias / runs).cwiseAbs().maxCoeff() * std::sqrt(runs);
  }
};

// The covariance is never smaller than the errors, and larger only by what inflation rounds up: that is
// independent of the errors, so that their product has the mean that the plain covariance would give.
void expect_consistent(const Score& score) {
  EXPECT_LT(score.mean(), 6 + score.tolerance());
  EXPECT_GT(score.mean_as_drawn(), 6 - score.tolerance());
  // Of 6 values.
  EXPECT_LT(score.worst_bias(), 4.5);
}

constexpr int kSolvedRuns = 600;

// Frames as they are drawn, which all can be solved.
Score score_of(const World& world, std::uint64_t seed) {
  Simulation simulation(seed);
  Score score;
  for (int run = 0; run < kSolvedRuns; ++run) {
    Frame frame = simulation.frame(world);
    SolvedMotion solved;
    EXPECT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    score.add(frame, solved);
  }
  return score;
}

TEST(OrientationSolve, ErrorsAreAsLargeAsTheCovarianceSaysWithAndWithoutTelemetry) {
  for (const double line_delay : {20e-6, -14.2e-6}) {
    for (const bool has_telemetry : {true, false}) {
      for (const double weak : {1.0, 1e3}) {
        for (const double shared : {0.0, 1e-5}) {
          for (const int landmarks : {30, 120}) {
            // Of all combinations those in which any three values meet as often as any other three.
            if (((line_delay > 0) ^ has_telemetry ^ (weak > 1) ^ (shared > 0) ^ (landmarks > 30)))
              continue;
            SCOPED_TRACE(testing::Message() << line_delay << ' ' << has_telemetry << ' ' << weak
                                            << ' ' << shared << ' ' << landmarks);
            World world;
            world.line_delay = line_delay;
            world.landmarks = landmarks;
            world.has_telemetry = has_telemetry;
            world.telemetry_angle *= weak;
            world.telemetry_rate *= weak;
            world.shared = shared;
            const Score score = score_of(world, 1);
            expect_consistent(score);
            // The gate's thousandth, and what a far start costs.
            EXPECT_GT(score.inliers, 0.995 * kSolvedRuns * landmarks);
            EXPECT_LT(score.mean_inflation(), 1.3);
          }
        }
      }
    }
  }
}

// Telemetry gives what the landmarks cannot: where they are in the base frame, and, with few of them,
// rates.
TEST(OrientationSolve, IsNeverLessSureThanEitherSource) {
  Simulation simulation(2);
  World world;
  int compared = 0;
  for (int run = 0; run < 100; ++run) {
    Frame frame = simulation.frame(world);
    SolvedMotion with;
    ASSERT_EQ(frame.solve(world, &with), SolveStatus::kOk);
    frame.prior.has_telemetry = false;
    SolvedMotion without;
    ASSERT_EQ(frame.solve(world, &without), SolveStatus::kOk);
    // A landmark at the gate may be in one of them only.
    if (with.inliers != without.inliers) continue;
    ++compared;
    // The residuals about another solution give another inflation.
    const double other = 1.0001 * std::max(1.0, with.inflation / without.inflation);
    for (int i = 0; i < 6; ++i) {
      EXPECT_LE(with.covariance(i, i), other * without.covariance(i, i)) << i;
      EXPECT_LE(with.frame_covariance(i, i), other * without.frame_covariance(i, i)) << i;
    }
    for (int i = 0; i < 4; ++i) {
      EXPECT_LE(with.covariance(i, i), frame.prior.telemetry_covariance(i, i)) << i;
    }
  }
  EXPECT_GT(compared, 80);
}

enum class Wrong { kTogether, kEachByItself };

// 0.2 px is the largest standard deviation of a good one.
void spoil(Wrong wrong, double share, Simulation* simulation, Frame* frame,
           std::vector<bool>* spoilt) {
  const Vector2<double> together(8, -5);
  spoilt->assign(frame->landmarks.size(), false);
  const auto count = static_cast<std::size_t>(share * static_cast<double>(spoilt->size()));
  for (std::size_t i = 0; i < count; ++i) {
    const double turn = simulation->uniform(0, 2 * kPi);
    const Vector2<double> alone =
        simulation->uniform(2, 40) * Vector2<double>(std::cos(turn), std::sin(turn));
    frame->landmarks[i].residual += wrong == Wrong::kTogether ? together : alone;
    (*spoilt)[i] = true;
  }
}

TEST(OrientationSolve, FlagsThirtyPercentThatAgreeAndFortyFiveThatDoNot) {
  for (const bool has_telemetry : {true, false}) {
    for (const Wrong wrong : {Wrong::kTogether, Wrong::kEachByItself}) {
      SCOPED_TRACE(testing::Message() << has_telemetry << ' ' << static_cast<int>(wrong));
      World world;
      world.has_telemetry = has_telemetry;
      Simulation simulation(3);
      Score score;
      int good = 0;
      int good_in = 0;
      for (int run = 0; run < kSolvedRuns; ++run) {
        Frame frame = simulation.frame(world);
        std::vector<bool> spoilt;
        spoil(wrong, wrong == Wrong::kTogether ? 0.3 : 0.45, &simulation, &frame, &spoilt);
        SolvedMotion solved;
        ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
        for (std::size_t i = 0; i < spoilt.size(); ++i) {
          EXPECT_FALSE(spoilt[i] && frame.landmarks[i].inlier) << run << ' ' << i;
          good += spoilt[i] ? 0 : 1;
          good_in += !spoilt[i] && frame.landmarks[i].inlier ? 1 : 0;
        }
        score.add(frame, solved);
      }
      expect_consistent(score);
      // The gate's thousandth.
      EXPECT_GT(good_in, 0.997 * good);
    }
  }
}

TEST(OrientationSolve, RefusesTooFew) {
  Simulation simulation(4);
  World world;
  SolvedMotion solved;
  Frame frame = simulation.frame(world);
  for (int count : {0, 1, 7}) {
    EXPECT_EQ(solve_orientation(frame.landmarks.data(), count, frame.prior, {}, kSolvedWidth,
                                kSolvedHeight, world.half_readout_s(), &solved),
              SolveStatus::kTooFew);
  }
  EXPECT_EQ(solve_orientation(nullptr, 0, frame.prior, {}, kSolvedWidth, kSolvedHeight,
                              world.half_readout_s(), &solved),
            SolveStatus::kTooFew);
  EXPECT_EQ(solve_orientation(frame.landmarks.data(), 8, frame.prior, {}, kSolvedWidth,
                              kSolvedHeight, world.half_readout_s(), &solved),
            SolveStatus::kOk);
}

// A fifth agrees, and the rest lies far away on all sides.
TEST(OrientationSolve, RefusesTooSmallAShareOfAll) {
  World world;
  world.landmarks = 100;
  Simulation simulation(17);
  Frame frame = simulation.frame(world);
  for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (i % 5 == 0) continue;
    const double away = simulation.uniform(300, 900);
    frame.landmarks[i].residual += away * Vector2<double>(i % 5 < 3 ? 1 : -1, i % 2 == 0 ? 1 : -1);
  }
  SolvedMotion solved;
  EXPECT_EQ(frame.solve(world, &solved), SolveStatus::kTooFew);
  SolveLimits limits;
  limits.min_inlier_share = 0.15;
  EXPECT_EQ(frame.solve(world, &solved, limits), SolveStatus::kOk);
  EXPECT_EQ(solved.inliers, 20);
}

// Better than claimed is as good as claimed: also where nothing is left over.
TEST(OrientationSolve, DoesNotMindLandmarksThatLieExactlyWhereTheyWereExpected) {
  for (const bool has_telemetry : {true, false}) {
    World world;
    world.has_telemetry = has_telemetry;
    Simulation simulation(18);
    Frame frame = simulation.frame(world);
    Frame exact = frame;
    for (FoundLandmark& landmark : exact.landmarks) landmark.residual.setZero();
    SolvedMotion as_claimed;
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &as_claimed), SolveStatus::kOk);
    ASSERT_EQ(exact.solve(world, &solved), SolveStatus::kOk);
    EXPECT_EQ(solved.inliers, world.landmarks);
    EXPECT_EQ(solved.inflation, 1);
    EXPECT_LE(solved.covariance(0, 0), 1.0001 * as_claimed.covariance(0, 0));
    EXPECT_GT(solved.covariance(0, 0), 0.5 * as_claimed.covariance(0, 0));
  }
}

// Landmarks that hardly agree are as good as noise that large: telemetry stays what it was.
TEST(OrientationSolve, BelievesLittleOfLandmarksThatAgreeOnNothing) {
  World world;
  world.landmarks = 40;
  Simulation simulation(16);
  double squares = 0;
  int solved_runs = 0;
  for (int run = 0; run < kSolvedRuns; ++run) {
    Frame frame = simulation.frame(world);
    std::vector<bool> spoilt;
    spoil(Wrong::kEachByItself, 0.9, &simulation, &frame, &spoilt);
    SolvedMotion solved;
    const SolveStatus status = frame.solve(world, &solved);
    if (status != SolveStatus::kOk) {
      EXPECT_TRUE(status == SolveStatus::kTooFew || status == SolveStatus::kContradiction);
      continue;
    }
    ++solved_runs;
    squares += normalised(error_of(frame, solved), solved.covariance);
  }
  EXPECT_LT(squares, 6 * solved_runs + 4 * std::sqrt(12.0 * solved_runs));
}

TEST(OrientationSolve, SaysThatLandmarksAndTelemetryExcludeEachOther) {
  Simulation simulation(5);
  World world;
  int refused = 0;
  for (int run = 0; run < 200; ++run) {
    Frame frame = simulation.frame(world);
    Frame near = frame;
    // Of the difference: telemetry, offset and next to nothing.
    const double sigma = std::hypot(world.telemetry_angle, world.offset);
    const double turn = simulation.uniform(0, 2 * kPi);
    const Vector2<double> away(std::cos(turn), std::sin(turn));
    for (FoundLandmark& landmark : frame.landmarks) {
      landmark.residual += landmark.J_angle * (10 * sigma * away);
    }
    for (FoundLandmark& landmark : near.landmarks) {
      landmark.residual += landmark.J_angle * (2 * sigma * away);
    }
    SolvedMotion solved;
    // chi-square of 2 degrees above 36 - 10 sigma beside 6 - is less than one in 10^4.
    EXPECT_EQ(frame.solve(world, &solved), SolveStatus::kContradiction);
    EXPECT_EQ(near.solve(world, &solved), SolveStatus::kOk);
    EXPECT_LT(solved.contradiction, SolveLimits{}.max_contradiction);
    ++refused;
    frame.prior.has_telemetry = false;
    EXPECT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    EXPECT_EQ(solved.contradiction, 0);
  }
  EXPECT_EQ(refused, 200);
}

// An edge says nothing along itself; it may not cost the others their covariance.
TEST(OrientationSolve, TakesFromEdgesWhatTheyKnow) {
  for (const double edges : {0.5, 1.0}) {
    SCOPED_TRACE(edges);
    World world;
    world.edges = edges;
    expect_consistent(score_of(world, 6));
  }
}

TEST(OrientationSolve, LeavesRatesToTelemetryWithoutALineDelay) {
  World world;
  world.line_delay = 0;
  Simulation simulation(7);
  Score score;
  for (int run = 0; run < kSolvedRuns; ++run) {
    Frame frame = simulation.frame(world);
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    for (int i = 2; i < 4; ++i) {
      const double sigma = world.telemetry_rate;
      EXPECT_NEAR(solved.correction[i], frame.prior.telemetry[i], 1e-6 * sigma);
      EXPECT_NEAR(solved.covariance(i, i), sigma * sigma, 1e-6 * sigma * sigma);
    }
    EXPECT_NEAR(solved.covariance(4, 4), kPriorAccelerationSigma * kPriorAccelerationSigma, 1e-6);
    score.add(frame, solved);
  }
  expect_consistent(score);
}

// Inflation is the mean of 2 n - 6 squares, so that the errors over it are F distributed: their mean is
// larger by (2 n - 6) / (2 n - 8).
TEST(OrientationSolve, FindsOutThatNoiseWasUnderstated) {
  World world;
  world.understated = 3;
  world.has_telemetry = false;
  const Score score = score_of(world, 8);
  const double freedom = 2 * world.landmarks - 6;
  EXPECT_LT(score.mean(), 6 * freedom / (freedom - 2) + score.tolerance());
  // The larger of two estimates with standard deviations of 9 and 13 % is too large by up to 6 %, and
  // what the gate takes off is less than 1 %.
  EXPECT_GT(score.mean_inflation(), 9 * 0.99);
  EXPECT_LT(score.mean_inflation(), 9 * 1.10);
}

// Three landmarks in each of 60 neighbourhoods, with an error in common that is thrice their own: one by
// one their squares are 1 + 9 times what is claimed, their averages' 1 + 3 * 9.
TEST(OrientationSolve, FindsErrorsThatNeighboursShare) {
  World world;
  world.landmarks = 180;
  world.has_telemetry = false;
  Simulation simulation(9);
  Score score;
  constexpr int kColumns = 10;
  constexpr int kRows = 6;
  for (int run = 0; run < kSolvedRuns; ++run) {
    std::vector<Vector2<double>> positions;
    for (int cell = 0; cell < kColumns * kRows; ++cell) {
      for (int i = 0; i < 3; ++i) {
        positions.emplace_back(
            kSolvedWidth * (cell % kColumns + simulation.uniform(0.01, 0.99)) / kColumns,
            kSolvedHeight * (cell / kColumns + simulation.uniform(0.01, 0.99)) / kRows);
      }
    }
    Frame frame = simulation.frame(world, positions);
    for (std::size_t cell = 0; cell < kColumns * kRows; ++cell) {
      const Vector2<double> common(simulation.normal(3 * kNoise), simulation.normal(3 * kNoise));
      for (std::size_t i = 0; i < 3; ++i) frame.landmarks[3 * cell + i].residual += common;
    }
    // All alike, as the numbers above want it.
    for (FoundLandmark& landmark : frame.landmarks) {
      landmark.covariance = kNoise * kNoise * Matrix2<double>::Identity();
    }
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    score.add(frame, solved);
  }
  const double freedom = 2 * kColumns * kRows - 6;
  EXPECT_NEAR(score.mean_inflation(), 1 + 3 * 9, 0.05 * (1 + 3 * 9));
  EXPECT_LT(score.mean(), 6 * freedom / (freedom - 2) + score.tolerance());
  EXPECT_GT(score.mean(), 5);
}

// Frame after frame from the same mount, each with telemetry noise of its own: what is known of the offset
// is the mean of all.
TEST(OrientationSolve, AveragesTelemetryOverAllFrames) {
  World world;
  world.landmarks = 40;
  constexpr int kFrames = 100;
  constexpr int kMounts = 200;
  Simulation simulation(10);
  double squares = 0;
  Vector2<double> bias = Vector2<double>::Zero();
  for (int mount = 0; mount < kMounts; ++mount) {
    MapOffset offset;
    offset.covariance = world.offset * world.offset * Matrix2<double>::Identity();
    Vector2<double> g;
    double information = 1 / (world.offset * world.offset);
    for (int i = 0; i < kFrames; ++i) {
      Frame frame = simulation.frame(world);
      if (i == 0) g = frame.g;
      frame.g = g - offset.value;
      simulation.measure(world, &frame);
      frame.prior.offset_covariance = offset.covariance;
      SolvedMotion solved;
      ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
      const MapOffset before = offset;
      ASSERT_TRUE(offset.learn(solved.innovation, solved.innovation_covariance,
                               Sensitivity<2>::Zero(), kNoLimit));
      // Without an error that the landmarks share, all that the frame found is every frame's.
      const double sigma = world.telemetry_angle;
      ASSERT_LT((offset.value - before.value - solved.offset_correction).norm(), 1e-6 * sigma);
      ASSERT_LE(offset.covariance.trace(), before.covariance.trace());
      const Matrix2<double>& covariance = offset.covariance;
      // The landmarks' own noise of a frame is 0.1 px / sqrt(40) = 2e-6 rad beside telemetry's 3e-5; its
      // correlation with rate and acceleration makes it no more than 3 times that.
      information += 1 / (world.telemetry_angle * world.telemetry_angle);
      const Vector2<double> variances = Eigen::SelfAdjointEigenSolver<Matrix2<double>>()
                                            .computeDirect(covariance, Eigen::EigenvaluesOnly)
                                            .eigenvalues();
      ASSERT_GT(variances[0], 0.999 / information);
      ASSERT_LT(variances[1], 1.05 / information);
    }
    const Vector2<double> error = offset.value - g;
    squares += error.dot(offset.covariance.ldlt().solve(error));
    bias += error.cwiseQuotient(offset.covariance.diagonal().cwiseSqrt()) / kMounts;
  }
  EXPECT_NEAR(squares / kMounts, 2, 4 * std::sqrt(4.0 / kMounts));
  EXPECT_LT(bias.cwiseAbs().maxCoeff() * std::sqrt(kMounts), 4);
}

TEST(OrientationSolve, LearnsNothingFromAnInnovationThatCannotBe) {
  MapOffset offset;
  offset.value = {1e-3, 2e-3};
  offset.covariance << 4e-10, 1e-10, 1e-10, 9e-10;
  const MapOffset before = offset;
  const Matrix2<double> noise = 5e-10 * Matrix2<double>::Identity();
  const Vector2<double> sigma =
      (before.covariance + noise).llt().matrixL() * Vector2<double>::UnitX();
  EXPECT_FALSE(offset.learn(6.001 * sigma, noise, Sensitivity<2>::Zero(), 36));
  EXPECT_FALSE(offset.learn({kNaN, 0}, noise, Sensitivity<2>::Zero(), 36));
  EXPECT_EQ(offset.value, before.value);
  EXPECT_EQ(offset.covariance, before.covariance);
  EXPECT_TRUE(offset.learn(5.999 * sigma, noise, Sensitivity<2>::Zero(), 36));
  EXPECT_NE(offset.value, before.value);
}

// What the landmarks of a frame have in common is not learnt as every frame's offset.
TEST(OrientationSolve, KeepsTheLandmarksCommonErrorOutOfTheLastingOffset) {
  World world;
  world.landmarks = 40;
  world.shared = 4e-5;
  constexpr int kFrames = 100;
  constexpr int kMounts = 200;
  Simulation simulation(11);
  double squares = 0;
  for (int mount = 0; mount < kMounts; ++mount) {
    MapOffset offset;
    offset.covariance = world.offset * world.offset * Matrix2<double>::Identity();
    const Vector2<double> g(simulation.normal(world.offset), simulation.normal(world.offset));
    for (int i = 0; i < kFrames; ++i) {
      Frame frame = simulation.frame(world);
      frame.g = g - offset.value +
                Vector2<double>(simulation.normal(world.shared), simulation.normal(world.shared));
      simulation.measure(world, &frame);
      frame.prior.offset_covariance = offset.covariance;
      SolvedMotion solved;
      ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
      ASSERT_TRUE(offset.learn(solved.innovation,
                               solved.innovation_covariance + solved.shared_covariance,
                               Sensitivity<2>::Zero(), kNoLimit));
    }
    const Vector2<double> error = offset.value - g;
    squares += error.dot(offset.covariance.ldlt().solve(error));
  }
  EXPECT_NEAR(squares / kMounts, 2, 4 * std::sqrt(4.0 / kMounts));
}

// What is seen within its claims makes the problem linear: one calibration's residuals and prior become
// another's as their sensitivities tell, and the solution follows.
TEST(OrientationSolve, SensitivityIsHowTheSolutionFollowsTheCalibration) {
  for (const bool has_telemetry : {true, false}) {
    World world;
    world.has_telemetry = has_telemetry;
    world.understated = 0.3;
    Simulation simulation(31);
    Frame frame = simulation.frame(world);
    // Weak enough to leave the landmarks their say, strong enough to be seen.
    Vector6 sigma;
    sigma << 3e-6, 3e-6, 1e-3, 1e-3, kPriorAccelerationSigma, kPriorAccelerationSigma;
    frame.prior.motion_information.diagonal() = sigma.cwiseAbs2().cwiseInverse();
    frame.prior.motion.head<4>() = frame.x.head<4>();
    const auto fill = [&](auto* sensitivity, double scale) {
      for (int i = 0; i < sensitivity->size(); ++i) (*sensitivity)(i) = simulation.normal(scale);
    };
    for (FoundLandmark& landmark : frame.landmarks) fill(&landmark.sensitivity, kNoise);
    fill(&frame.prior.telemetry_sensitivity, world.telemetry_angle);
    fill(&frame.prior.motion_sensitivity, 3e-6);
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    ASSERT_EQ(solved.inflation, 1);
    constexpr double kStep = 0.1;
    for (int j = 0; j < kParameterCount; ++j) {
      const auto with = [&](double change) {
        Frame changed = frame;
        for (FoundLandmark& landmark : changed.landmarks) {
          landmark.residual += change * landmark.sensitivity.col(j);
        }
        changed.prior.telemetry += change * changed.prior.telemetry_sensitivity.col(j);
        changed.prior.motion += change * changed.prior.motion_sensitivity.col(j);
        SolvedMotion out;
        EXPECT_EQ(changed.solve(world, &out), SolveStatus::kOk);
        EXPECT_EQ(out.inliers, solved.inliers);
        return out;
      };
      const SolvedMotion more = with(kStep);
      const SolvedMotion less = with(-kStep);
      const Vector6 numeric = (more.correction - less.correction) / (2 * kStep);
      EXPECT_LT((solved.sensitivity.col(j) - numeric).cwiseQuotient(sigma).norm(),
                1e-6 * numeric.cwiseQuotient(sigma).norm());
      const Vector2<double> of_offset =
          (more.offset_correction - less.offset_correction) / (2 * kStep);
      EXPECT_LT((solved.offset_correction_sensitivity.col(j) - of_offset).norm(),
                1e-6 * of_offset.norm() + 1e-18);
      EXPECT_EQ(of_offset.norm() > 0, has_telemetry);
    }
  }
}

// The same where landmarks contradict their claims, and count so much less beside what is known without them.
TEST(OrientationSolve, SensitivityHoldsWhereLandmarksAreLessSureThanTheyClaim) {
  for (const bool has_telemetry : {true, false}) {
    World world;
    world.has_telemetry = has_telemetry;
    world.understated = 5;
    SolveLimits limits;
    limits.max_scale = 3;
    Simulation simulation(33);
    // In few parts of the image: inflation is then the limit, and does not follow the residuals.
    std::vector<Vector2<double>> positions;
    for (int i = 0; i < 120; ++i) {
      positions.emplace_back(simulation.uniform(100, 380), simulation.uniform(200, 700));
    }
    Frame frame = simulation.frame(world, positions);
    Vector6 sigma;
    sigma << 3e-5, 3e-5, 1e-2, 1e-2, kPriorAccelerationSigma, kPriorAccelerationSigma;
    frame.prior.motion_information.diagonal() = sigma.cwiseAbs2().cwiseInverse();
    frame.prior.motion = frame.x;
    for (FoundLandmark& landmark : frame.landmarks) {
      for (int i = 0; i < landmark.sensitivity.size(); ++i) {
        landmark.sensitivity(i) = simulation.normal(kNoise);
      }
    }
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &solved, limits), SolveStatus::kOk);
    ASSERT_EQ(solved.inflation, 9);
    constexpr double kStep = 1e-3;
    for (int j = 0; j < kParameterCount; ++j) {
      const auto with = [&](double change) {
        Frame changed = frame;
        for (FoundLandmark& landmark : changed.landmarks) {
          landmark.residual += change * landmark.sensitivity.col(j);
        }
        SolvedMotion out;
        EXPECT_EQ(changed.solve(world, &out, limits), SolveStatus::kOk);
        EXPECT_EQ(out.inliers, solved.inliers);
        EXPECT_EQ(out.inflation, 9);
        return out;
      };
      const Vector6 numeric = (with(kStep).correction - with(-kStep).correction) / (2 * kStep);
      EXPECT_GT(numeric.norm(), 0);
      EXPECT_LT((solved.sensitivity.col(j) - numeric).cwiseQuotient(sigma).norm(),
                1e-6 * numeric.cwiseQuotient(sigma).norm());
    }
  }
}

TEST(OrientationSolve, OffsetFollowsTheCalibrationAsItsSensitivitySays) {
  Simulation simulation(32);
  MapOffset offset;
  offset.covariance << 4e-10, 1e-10, 1e-10, 9e-10;
  MapOffset changed = offset;
  const Matrix2<double> noise = 5e-10 * Matrix2<double>::Identity();
  constexpr int kParameter = 7;
  for (int i = 0; i < 20; ++i) {
    const Vector2<double> innovation(simulation.normal(1e-6), simulation.normal(1e-6));
    Sensitivity<2> sensitivity = -offset.sensitivity;
    sensitivity.col(kParameter) += Vector2<double>(1 + i, 2) * 1e-6;
    const Vector2<double> in_changed =
        innovation - (changed.value - offset.value) + Vector2<double>(1 + i, 2) * 1e-6;
    ASSERT_TRUE(offset.learn(innovation, noise, sensitivity, kNoLimit));
    ASSERT_TRUE(changed.learn(in_changed, noise, sensitivity, kNoLimit));
  }
  const Vector2<double> difference = changed.value - offset.value;
  EXPECT_GT(difference.norm(), 1e-6);
  EXPECT_LT((offset.sensitivity.col(kParameter) - difference).norm(), 1e-9 * difference.norm());
}

// The same landmark many times is one.
TEST(OrientationSolve, KeepsItsCovarianceWhenLandmarksRepeat) {
  World world;
  world.has_telemetry = false;
  world.landmarks = 60;
  Simulation simulation(12);
  Score score;
  for (int run = 0; run < kSolvedRuns; ++run) {
    Frame frame = simulation.frame(world);
    const std::vector<FoundLandmark> once = frame.landmarks;
    for (int i = 0; i < 3; ++i) {
      frame.landmarks.insert(frame.landmarks.end(), once.begin(), once.end());
    }
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
    score.add(frame, solved);
  }
  // Four times as much as is there: found with a standard deviation of 0.7 a frame.
  EXPECT_NEAR(score.mean_inflation(), 4, 0.2);
  // Neighbourhoods of one landmark find all of it; about 38 of 60 are in use.
  EXPECT_LT(score.mean(), 6 * 70.0 / 68 + score.tolerance());
}

TEST(OrientationSolve, SolvesForLandmarksInOnePlace) {
  World world;
  Simulation simulation(13);
  for (const int places : {1, 2, 3}) {
    for (int run = 0; run < 50; ++run) {
      std::vector<Vector2<double>> positions;
      for (int i = 0; i < 60; ++i)
        positions.emplace_back(500 + 300 * (i % places), 400 + 200 * (i % places));
      Frame frame = simulation.frame(world, positions);
      SolvedMotion solved;
      ASSERT_EQ(frame.solve(world, &solved), SolveStatus::kOk);
      EXPECT_TRUE(all_finite(solved.correction));
      EXPECT_GT(solved.covariance.ldlt().vectorD().minCoeff(), 0);
    }
  }
}

TEST(OrientationSolve, WritesNothingThatIsNotFinite) {
  const double kInfinity = std::numeric_limits<double>::infinity();
  Simulation simulation(14);
  int refused = 0;
  int tried = 0;
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300, 0.0}) {
    for (const bool has_telemetry : {true, false}) {
      for (const double line_delay : {20e-6, 0.0}) {
        World world;
        world.has_telemetry = has_telemetry;
        world.line_delay = line_delay;
        world.landmarks = 30;
        for (const int how_many : {1, 12, 30}) {
          for (int what = 0; what < 14; ++what) {
            Frame frame = simulation.frame(world);
            for (int i = 0; i < how_many; ++i) {
              FoundLandmark& landmark = frame.landmarks[static_cast<std::size_t>(i)];
              if (what == 0) landmark.residual.x() = bad;
              if (what == 1) landmark.residual.setConstant(bad);
              if (what == 2) landmark.J_angle(0, 1) = bad;
              if (what == 3) landmark.J_angle.setConstant(bad);
              if (what == 4) landmark.time_s = bad;
              if (what == 5) landmark.covariance.setConstant(bad);
              if (what == 6) landmark.covariance(1, 1) = bad;
              if (what == 7) landmark.shared_covariance(0, 0) = bad;
              if (what == 8 && std::isfinite(bad)) landmark.u.x() = bad;
            }
            if (what == 9) frame.prior.telemetry[1] = bad;
            if (what == 10) frame.prior.telemetry_covariance(2, 2) = bad;
            if (what == 11) frame.prior.offset_covariance(0, 0) = bad;
            if (what == 12) frame.prior.motion[3] = bad;
            if (what == 13) frame.prior.motion_information(5, 5) = bad;
            SolvedMotion solved;
            const SolveStatus status = frame.solve(world, &solved);
            ++tried;
            if (status != SolveStatus::kOk) {
              ++refused;
              continue;
            }
            SCOPED_TRACE(testing::Message()
                         << bad << " in " << what << " of " << how_many << ", telemetry "
                         << has_telemetry << ", line delay " << line_delay);
            EXPECT_TRUE(all_finite(solved.correction));
            EXPECT_TRUE(all_finite(solved.covariance));
            EXPECT_TRUE(all_finite(solved.frame_covariance));
            EXPECT_TRUE(all_finite(solved.shared_covariance));
            EXPECT_TRUE(all_finite(solved.offset_correction));
            EXPECT_TRUE(all_finite(solved.innovation));
            EXPECT_TRUE(all_finite(solved.innovation_covariance));
            EXPECT_TRUE(std::isfinite(solved.inflation));
            EXPECT_GE(solved.covariance.diagonal().minCoeff(), 0);
          }
        }
      }
    }
  }
  EXPECT_GT(refused, tried / 4);
}

// Nothing tells a rate: it may not be called exactly known.
TEST(OrientationSolve, DoesNotCallExactWhatNothingTells) {
  World world;
  world.line_delay = 0;
  world.has_telemetry = false;
  Simulation simulation(15);
  Frame frame = simulation.frame(world);
  SolvedMotion solved;
  if (frame.solve(world, &solved) == SolveStatus::kOk) {
    EXPECT_GT(solved.covariance(2, 2), 1);
    EXPECT_GT(solved.covariance(3, 3), 1);
  }
}

}  // namespace
}  // namespace alidade::test

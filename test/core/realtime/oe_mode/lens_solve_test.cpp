// The solution where the focal length is unknown, too: its errors against its covariance, and how it follows the calibration.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade::test {
namespace {

constexpr int kRowOfF = index(Parameter::kFocalLength);
constexpr double kLensWidth = 1280;
constexpr double kLensHeight = 720;
constexpr double kLensFocal = 4000;      // px
constexpr double kLineDelay = -14.2e-6;  // s/row
constexpr double kHalf_s = kLineDelay * kLensHeight / 2;
constexpr double kLensNoise = 0.08;      // px
constexpr double kAcceleration = 2;      // rad/s^2
constexpr double kOffset = 3e-5;         // rad
constexpr double kTelemetry = 4e-5;      // rad
constexpr double kTelemetryRate = 1e-3;  // rad/s

using Vector7 = Matrix<double, 7, 1>;
using Matrix7 = Matrix<double, 7, 7>;

struct LensWorld {
  double sigma = 2e-3;       // of phi
  double known = 0;          // its value before
  double correlation = 0.5;  // of phi and g
  double knows_lens = 0;     // 1: the landmarks came with this lens from here, 0: they are right
  bool has_telemetry = true;
  double claimed = 1;      // landmarks err by so much of what they claim
  double zoom = 0;         // sigma of log f of the frame's own lens; 0: it has none
  double zoom_rate = 0.5;  // 1/s, likewise of its rate
};

// A frame as it is drawn; x, g and phi are the truth, and what is told of it.
class LensFrame {
 public:
  LensFrame(const LensWorld& world, std::uint64_t seed) : random_(seed) {
    Calibration calibration;
    calibration.camera = {
        kLensFocal, 1, {-0.2}, static_cast<int>(kLensWidth), static_cast<int>(kLensHeight)};
    calibration.line_delay = kLineDelay;
    calibration.covariance(kRowOfF, kRowOfF) = std::pow(kLensFocal * world.sigma, 2);
    lens_ = LensScale::begin(calibration);
    lens_.value = world.known;
    const double n = normal(1);
    phi = world.known + world.sigma * n;
    const double rest = std::sqrt(1 - world.correlation * world.correlation);
    g = kOffset * Vector2<double>(world.correlation * n + rest * normal(1), normal(1));
    lens_.covariance_with_offset = {world.correlation * kOffset * world.sigma, 0};
    if (world.zoom > 0) {
      own = {normal(world.zoom), normal(world.zoom_rate)};
      zoom_.covariance.diagonal() << world.zoom * world.zoom, world.zoom_rate * world.zoom_rate;
      zoom_.value = {normal(world.zoom), 0};
      own += zoom_.value;
      prior.zoom = &zoom_;
    }
    x << normal(1 / kLensFocal), normal(1 / kLensFocal), normal(0.01), normal(0.01),
        normal(kAcceleration), normal(kAcceleration);
    const FrameMotion<double> motion{{0.3, -0.4}, {0.1, 0.05}, kLensHeight / 2};
    const ViewProjection view(calibration, motion);
    for (int i = 0; i < 120; ++i) {
      const Vector2<double> u(uniform(0, kLensWidth), uniform(0, kLensHeight));
      Vector3<double> d;
      SeenDirection seen;
      Sensitivity<2> J_parameters;
      EXPECT_EQ(rolling_shutter_unproject(calibration.camera, calibration.mechanics, kLineDelay,
                                          motion, u, &d),
                ProjectionStatus::kOk);
      EXPECT_TRUE(view.project(d, &seen, &J_parameters));
      FoundLandmark f{};
      f.u = seen.u;
      f.J_angle = seen.J_angle;
      f.time_s = seen.time_s;
      f.covariance = kLensNoise * kLensNoise * Matrix2<double>::Identity();
      f.shared_covariance.setZero();
      f.sensitivity = -(1 - world.knows_lens) * J_parameters;
      const Vector2<double> s = f.sensitivity * lens_.direction;
      f.by_zoom = J_parameters * lens_.direction;
      f.residual =
          f.J_angle * angle_at(x, f.time_s) - phi * s + (own[0] + f.time_s * own[1]) * f.by_zoom +
          Vector2<double>(normal(world.claimed * kLensNoise), normal(world.claimed * kLensNoise));
      landmarks.push_back(f);
    }
    prior.lens = &lens_;
    prior.offset_covariance = kOffset * kOffset * Matrix2<double>::Identity();
    prior.motion_information.diagonal().tail<2>().setConstant(1 / (kAcceleration * kAcceleration));
    prior.has_telemetry = world.has_telemetry;
    if (!world.has_telemetry) return;
    prior.telemetry = x.head<4>();
    prior.telemetry.head<2>() += g;
    const Vector4<double> sigma(kTelemetry, kTelemetry, kTelemetryRate, kTelemetryRate);
    for (int i = 0; i < 4; ++i) prior.telemetry[i] += normal(sigma[i]);
    prior.telemetry_covariance = sigma.cwiseAbs2().asDiagonal();
  }
  LensFrame(const LensFrame&) = delete;
  LensFrame& operator=(const LensFrame&) = delete;

  SolveStatus solve(SolvedMotion* out) {
    return solve_orientation(landmarks.data(), static_cast<int>(landmarks.size()), prior,
                             SolveLimits{}, kLensWidth, kLensHeight, kHalf_s, out);
  }
  double normal(double sigma) { return sigma * std::normal_distribution<double>()(random_); }
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  Vector6 x;          // map's frame
  Vector2<double> g;  // of the offset
  double phi = 0;
  Vector2<double> own = Vector2<double>::Zero();  // log f and its rate, beside phi
  std::vector<FoundLandmark> landmarks;
  MotionPrior prior;
  LensScale lens_;
  ZoomPrior zoom_;

 private:
  std::mt19937_64 random_;
};

// Of base angle, rate and acceleration, by a unit of phi.
Vector6 by_lens_of(const SolvedLens& lens) {
  Vector6 by_lens = lens.motion_by_lens;
  by_lens.head<2>() += lens.offset_by_lens;
  return by_lens;
}

// Of base angle, rate and acceleration, and phi.
Vector7 estimate_of(const SolvedMotion& solved) {
  Vector7 out;
  out << solved.correction + solved.lens.value * by_lens_of(solved.lens), solved.lens.value;
  out.head<2>() += solved.offset_correction;
  return out;
}

Vector7 truth_of(const LensFrame& frame) {
  Vector7 truth;
  truth << frame.x, frame.phi;
  truth.head<2>() += frame.g;
  return truth;
}

Matrix7 covariance_of(const SolvedMotion& solved) {
  Vector7 with_lens;
  with_lens << by_lens_of(solved.lens), 1;
  Matrix7 out = solved.lens.variance * with_lens * with_lens.transpose();
  out.topLeftCorner<6, 6>() += solved.covariance;
  return out;
}

TEST(LensSolve, ErrsAsItsCovarianceSays) {
  constexpr int kRuns = 300;
  for (const double sigma : {1e-5, 2e-3, 1e-2}) {
    for (const double known : {0.0, -3e-3}) {
      for (const double knows_lens : {0.0, 0.9, 1.0}) {
        for (const bool has_telemetry : {true, false}) {
          SCOPED_TRACE(testing::Message()
                       << sigma << ' ' << known << ' ' << knows_lens << ' ' << has_telemetry);
          LensWorld world;
          world.sigma = sigma;
          world.known = known;
          world.knows_lens = knows_lens;
          world.has_telemetry = has_telemetry;
          double squares = 0;
          double as_drawn = 0;  // by the covariance before inflation, about
          for (int run = 0; run < kRuns; ++run) {
            LensFrame frame(world, static_cast<std::uint64_t>(run));
            SolvedMotion solved;
            ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
            const Vector7 error = estimate_of(solved) - truth_of(frame);
            const double square = error.dot(covariance_of(solved).ldlt().solve(error));
            squares += square / kRuns;
            as_drawn += solved.inflation * square / kRuns;
          }
          // Four standard deviations of the mean of chi-squares of 7 degrees.
          const double tolerance = 4 * std::sqrt(14.0 / kRuns);
          EXPECT_LT(squares, 7 + tolerance);
          EXPECT_GT(as_drawn, 7 - tolerance);
        }
      }
    }
  }
}

TEST(LensSolve, ErrsAsItsCovarianceSaysWhereTheFrameHasALensOfItsOwn) {
  constexpr int kRuns = 300;
  for (const double zoom : {1e-5, 2e-3}) {
    for (const double knows_lens : {0.9, 1.0}) {
      for (const bool has_telemetry : {true, false}) {
        SCOPED_TRACE(testing::Message() << zoom << ' ' << knows_lens << ' ' << has_telemetry);
        LensWorld world;
        world.knows_lens = knows_lens;
        world.has_telemetry = has_telemetry;
        world.zoom = zoom;
        double squares = 0;
        double of_zoom = 0;
        double error_square = 0;
        for (int run = 0; run < kRuns; ++run) {
          LensFrame frame(world, static_cast<std::uint64_t>(run));
          SolvedMotion solved;
          ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
          const Vector7 error = estimate_of(solved) - truth_of(frame);
          squares += error.dot(covariance_of(solved).ldlt().solve(error)) / kRuns;
          const SolvedZoom& own = solved.zoom;
          const Vector2<double> own_error =
              own.correction + solved.lens.value * own.by_lens - frame.own;
          const Matrix2<double> covariance =
              own.covariance + solved.lens.variance * own.by_lens * own.by_lens.transpose();
          of_zoom += own_error.dot(covariance.inverse() * own_error) / kRuns;
          error_square += own_error[0] * own_error[0] / kRuns;
        }
        // Four standard deviations of the means of chi-squares of 7 and of 2 degrees.
        EXPECT_LT(squares, 7 + 4 * std::sqrt(14.0 / kRuns));
        EXPECT_LT(of_zoom, 2 + 4 * std::sqrt(4.0 / kRuns));
        // Landmarks that came with phi leave it to them alone, 420 px from the centre.
        if (knows_lens == 1) {
          EXPECT_LT(std::sqrt(error_square), 2 * kLensNoise / (420 * std::sqrt(120.0)));
        }
      }
    }
  }
}

// The offset was learnt at half the focal length: what the optical centre errs by there is twice the angle. Besides, it errs by
// something of this zoom's own.
TEST(LensSolve, ContradictionAllowsForTheCentreAtAnotherZoom) {
  constexpr int kRuns = 300;
  constexpr double kSharedCentre = 2;  // px
  constexpr double kOwnCentre = 0.5;   // px
  LensWorld world;
  world.knows_lens = 1;
  world.zoom = 1e-3;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    LensFrame frame(world, static_cast<std::uint64_t>(run));
    for (int axis = 0; axis < 2; ++axis) {
      const int centre = index(Parameter::kCentreU) + axis;
      for (FoundLandmark& f : frame.landmarks)
        f.sensitivity.col(centre) = -Vector2<double>::Unit(axis);
    }
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
    const Sensitivity<2> of_landmarks = solved.sensitivity.topRows<2>();
    for (int axis = 0; axis < 2; ++axis) {
      const int centre = index(Parameter::kCentreU) + axis;
      const double shared = frame.normal(kSharedCentre);
      const double own = frame.normal(kOwnCentre);
      for (FoundLandmark& f : frame.landmarks)
        f.residual += (shared + own) * f.sensitivity.col(centre);
      frame.prior.telemetry_sensitivity.block<2, 1>(0, centre) = 2 * of_landmarks.col(centre);
      frame.prior.telemetry.head<2>() += 2 * shared * of_landmarks.col(centre);
      frame.lens_.others(centre, centre) = kSharedCentre * kSharedCentre;
      frame.zoom_.own_variances[centre] = kOwnCentre * kOwnCentre;
    }
    ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk) << run;
    squares += solved.contradiction / kRuns;
    // What lies beyond that is still one: 20 px are 10 of the angle's sigmas.
    frame.prior.telemetry[0] += 20 / kLensFocal;
    EXPECT_EQ(frame.solve(&solved), SolveStatus::kContradiction) << run;
  }
  EXPECT_NEAR(squares, 2, 4 * std::sqrt(4.0 / kRuns));
}

// A lens that is known before as well as anything is one that there is none of.
TEST(LensSolve, IsTheSameWhereTheFramesLensIsKnown) {
  LensWorld world;
  LensFrame without(world, 5);
  LensFrame with(world, 5);
  ZoomPrior zoom;
  zoom.covariance = 1e-20 * Matrix2<double>::Identity();
  with.prior.zoom = &zoom;
  SolvedMotion a;
  SolvedMotion b;
  ASSERT_EQ(without.solve(&a), SolveStatus::kOk);
  ASSERT_EQ(with.solve(&b), SolveStatus::kOk);
  for (int i = 0; i < 6; ++i) {
    const double sigma = std::sqrt(a.covariance(i, i));
    EXPECT_NEAR(a.correction[i], b.correction[i], 1e-4 * sigma);
    EXPECT_NEAR(a.covariance(i, i), b.covariance(i, i), 1e-4 * a.covariance(i, i));
  }
  EXPECT_NEAR(a.lens.value, b.lens.value, 1e-4 * std::sqrt(a.lens.variance));
  EXPECT_LT(b.zoom.correction.norm(), 1e-9);
}

// How it comes out by other parameters, from the same frame: the linear problem is linear.
TEST(LensSolve, OwnLensFollowsTheParametersAsItsSensitivitySays) {
  LensWorld world;
  world.knows_lens = 1;
  world.zoom = 1e-3;
  LensFrame frame(world, 6);
  const int axis = index(Parameter::kPanAxis0);
  constexpr double kStep = 1e-5;
  for (FoundLandmark& f : frame.landmarks) {
    f.sensitivity.col(axis) = Vector2<double>(f.u.x() - 600, 0.5 * f.u.y() * f.time_s * 1e3);
  }
  frame.zoom_.sensitivity(0, axis) = 0.3;
  SolvedMotion before;
  ASSERT_EQ(frame.solve(&before), SolveStatus::kOk);
  for (FoundLandmark& f : frame.landmarks) f.residual += kStep * f.sensitivity.col(axis);
  frame.zoom_.value[0] += kStep * 0.3;
  SolvedMotion after;
  ASSERT_EQ(frame.solve(&after), SolveStatus::kOk);
  ASSERT_EQ(before.inliers, after.inliers);
  const Vector2<double> change = (after.zoom.correction - before.zoom.correction) / kStep;
  const Vector2<double> expected = before.zoom.sensitivity.col(axis);
  EXPECT_NEAR(change[0], expected[0], 0.02 * std::abs(expected[0]));
  EXPECT_NEAR(change[1], expected[1], 0.02 * expected.norm());
}

// Landmarks that are right tell it by their scale; those that came with this lens, from here, tell nothing.
TEST(LensSolve, LearnsFromTheScaleOfWhatDoesNotKnowTheLens) {
  LensWorld world;
  world.correlation = 0;
  LensFrame right(world, 7);
  SolvedMotion solved;
  ASSERT_EQ(right.solve(&solved), SolveStatus::kOk);
  // 120 of 0.08 px, 420 px from the centre, root mean square.
  const double expected = kLensNoise / (420 * std::sqrt(120.0));
  EXPECT_LT(std::sqrt(solved.lens.variance), 2 * expected);
  EXPECT_NEAR(1 / std::sqrt(solved.lens.information), std::sqrt(solved.lens.variance),
              0.1 * std::sqrt(solved.lens.variance));
  EXPECT_LT(std::abs(solved.lens.measured - right.phi), 5 * expected);

  world.knows_lens = 1;
  LensFrame own(world, 7);
  ASSERT_EQ(own.solve(&solved), SolveStatus::kOk);
  EXPECT_NEAR(solved.lens.variance, own.lens_.variance, 1e-6 * own.lens_.variance);
  EXPECT_NEAR(solved.lens.value, own.lens_.value, 1e-3 * world.sigma);
}

// What frames before said already is no news.
TEST(LensSolve, CountsOldInformationOnce) {
  LensFrame frame(LensWorld{}, 8);
  SolvedMotion news;
  ASSERT_EQ(frame.solve(&news), SolveStatus::kOk);
  frame.prior.scale_inflation = 100;
  SolvedMotion old;
  ASSERT_EQ(frame.solve(&old), SolveStatus::kOk);
  EXPECT_DOUBLE_EQ(old.lens.information, news.lens.information);
  EXPECT_GT(old.lens.variance, 20 * news.lens.variance);
  EXPECT_LT(old.lens.variance, 110 * news.lens.variance);
}

// The limit of a lens that is known exactly.
TEST(LensSolve, IsAsWithoutALensWhereThatIsKnown) {
  for (const bool has_telemetry : {true, false}) {
    LensWorld world;
    world.sigma = 1e-9;
    world.correlation = 0;
    world.has_telemetry = has_telemetry;
    LensFrame frame(world, 9);
    SolvedMotion with_lens;
    ASSERT_EQ(frame.solve(&with_lens), SolveStatus::kOk);
    frame.prior.lens = nullptr;
    SolvedMotion without;
    ASSERT_EQ(frame.solve(&without), SolveStatus::kOk);
    EXPECT_EQ(with_lens.inliers, without.inliers);
    const Vector6 sigma = without.covariance.diagonal().cwiseSqrt();
    const Vector6 difference = with_lens.correction - without.correction;
    EXPECT_LT(difference.cwiseQuotient(sigma).norm(), 1e-4);
    EXPECT_LT((with_lens.covariance - without.covariance).norm(), 1e-6 * without.covariance.norm());
  }
}

// What phi may explain is no contradiction; what it may not is.
TEST(LensSolve, BlamesTheLensForWhatItCanDoOnly) {
  LensWorld world;
  world.sigma = 1e-2;
  world.correlation = 0;
  world.knows_lens = 1;
  LensFrame frame(world, 10);
  ASSERT_GT(std::abs(frame.phi), 0.5 * world.sigma);
  // Landmarks that came with this lens from a tenth of a radian away: angles go with f.
  const double away = 0.1;
  for (FoundLandmark& f : frame.landmarks) {
    f.sensitivity.col(kRowOfF) = -f.J_angle * Vector2<double>(away, 0) / kLensFocal;
    f.residual -= frame.phi * (f.sensitivity * frame.lens_.direction);
  }
  SolvedMotion solved;
  ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
  const double telemetry_sigma = std::hypot(kTelemetry, kOffset) / away;
  EXPECT_LT(std::abs(solved.lens.value - frame.phi), 5 * telemetry_sigma);
  EXPECT_LT(std::sqrt(solved.lens.variance), 1.1 * telemetry_sigma);
  EXPECT_NEAR(solved.lens.innovation_by_lens.x(), -away, 1e-6);
  // 10 sigmas of what the lens may do.
  frame.prior.telemetry[0] += 10 * world.sigma * away;
  EXPECT_EQ(frame.solve(&solved), SolveStatus::kContradiction);
  frame.prior.telemetry[0] -= 10 * world.sigma * away;
  // What it moves pan by does not excuse tilt.
  frame.prior.telemetry[1] += 8 * std::hypot(kTelemetry, kOffset);
  EXPECT_EQ(frame.solve(&solved), SolveStatus::kContradiction);
  frame.prior.lens = nullptr;
  frame.prior.telemetry[1] -= 8 * std::hypot(kTelemetry, kOffset);
  EXPECT_EQ(frame.solve(&solved), SolveStatus::kContradiction) << "the lens was needed";
}

TEST(LensSolve, FollowsTheCalibrationAsItsSensitivitySays) {
  for (const bool has_telemetry : {true, false}) {
    LensWorld world;
    world.has_telemetry = has_telemetry;
    world.claimed = 0.3;  // no inflation, which would follow the residuals
    LensFrame frame(world, 11);
    Sensitivity<1> of_lens;
    Sensitivity<4> of_telemetry;
    for (int j = 0; j < kParameterCount; ++j) {
      of_lens[j] = frame.normal(1e-3);
      for (int i = 0; i < 4; ++i) of_telemetry(i, j) = frame.normal(1e-4);
      for (FoundLandmark& f : frame.landmarks) {
        if (j != kRowOfF && !is_distortion(static_cast<Parameter>(j)))
          f.sensitivity.col(j) = Vector2<double>(frame.normal(0.1), frame.normal(0.1));
      }
    }
    frame.lens_.sensitivity = of_lens;
    frame.prior.telemetry_sensitivity = of_telemetry;
    frame.prior.scale_inflation = 3;
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
    const auto moved = [&](int j, double step) {
      for (FoundLandmark& f : frame.landmarks) f.residual += step * f.sensitivity.col(j);
      frame.lens_.value += step * of_lens[j];
      frame.prior.telemetry += step * of_telemetry.col(j);
      SolvedMotion out;
      EXPECT_EQ(frame.solve(&out), SolveStatus::kOk);
      EXPECT_EQ(out.inliers, solved.inliers);
      for (FoundLandmark& f : frame.landmarks) f.residual -= step * f.sensitivity.col(j);
      frame.lens_.value -= step * of_lens[j];
      frame.prior.telemetry -= step * of_telemetry.col(j);
      return out;
    };
    // But for f and the distortion, whose effect phi takes over.
    for (int j = 0; j < kParameterCount; ++j) {
      if (j == kRowOfF || is_distortion(static_cast<Parameter>(j))) continue;
      constexpr double kStep = 1e-3;
      const SolvedMotion more = moved(j, kStep);
      const SolvedMotion less = moved(j, -kStep);
      const double lens = (more.lens.value - less.lens.value) / (2 * kStep);
      EXPECT_NEAR(solved.lens.sensitivity[j], lens, 1e-3 * std::abs(lens) + 1e-9) << j;
      const double measured = (more.lens.measured - less.lens.measured) / (2 * kStep);
      EXPECT_NEAR(solved.lens.measured_sensitivity[j], measured, 1e-3 * std::abs(measured) + 1e-9)
          << j;
      const Vector6 motion = (more.correction - less.correction) / (2 * kStep);
      EXPECT_LT((solved.sensitivity.col(j) - motion).cwiseQuotient(motion).norm(), 1e-2) << j;
    }
  }
}

TEST(LensSolve, FindsWrongLandmarksWhereTheScaleIsWrongToo) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    LensWorld world;
    world.sigma = 5e-3;
    LensFrame frame(world, seed);
    for (std::size_t i = 0; i < frame.landmarks.size(); i += 4) {
      frame.landmarks[i].residual += Vector2<double>(frame.uniform(2, 4), frame.uniform(-4, -2));
    }
    SolvedMotion solved;
    ASSERT_EQ(frame.solve(&solved), SolveStatus::kOk);
    for (std::size_t i = 0; i < frame.landmarks.size(); i += 4) {
      EXPECT_FALSE(frame.landmarks[i].inlier);
    }
    EXPECT_GT(solved.inliers, 80);
    EXPECT_LT(std::abs(solved.lens.value - frame.phi), 5 * std::sqrt(solved.lens.variance));
  }
}

}  // namespace
}  // namespace alidade::test

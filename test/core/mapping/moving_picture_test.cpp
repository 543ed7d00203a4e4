// Pictures of a camera that turns and zooms while it is read out, and of whose motion nothing is told, or what telemetry knows: the pose
// is as good as it says, at rest, too.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/mapping/picture_pose.h"
#include "test/core/mapping/seen_picture.h"

namespace alidade::test {
namespace {

constexpr int kPictures = 40;
constexpr int kUnknowns = 4;  // rotation, log f

struct MotionCase {
  const char* name;
  double pan_fields, tilt_fields;  // fields of view a second
  double zoom_rate;                // 1/s
  double line_delay;               // s
};

const std::vector<MotionCase>& motions() {
  static const std::vector<MotionCase> cases = {
      {"at rest", 0, 0, 0, 30e-6},
      {"slowly", 0.05, 0.02, 0.01, 30e-6},
      {"all at once", 0.6, -0.3, 0.5, 30e-6},
      {"a fast pan", 1.5, 0, 0, 30e-6},
      {"a fast tilt", 0, 0.7, 0, 30e-6},
      {"zoom alone", 0, 0, 1, 30e-6},
      {"upside down", 0.6, 0.3, -0.5, -30e-6},
  };
  return cases;
}

SeenPicture moving_picture(const MotionCase& motion, double f, double pan, double tilt) {
  SeenPicture out = lively_picture(f, pan, tilt, 0);
  out.line_delay = motion.line_delay;
  const double field = out.width / f;
  // A pan moves what is seen less where the camera looks up.
  out.pan_rate = motion.pan_fields * field / std::cos(tilt);
  out.tilt_rate = motion.tilt_fields * field;
  out.zoom_rate = motion.zoom_rate;
  return out;
}

// As a scene map asks: rotation and f are free, the mount says about which axes it turns.
PoseKnowledge knowledge_of(const SeenPicture& picture) {
  PoseKnowledge out = picture.knowledge(true);
  out.turned_by = out.mechanics;
  out.mechanics.reset();
  return out;
}

PoseKnowledge without_motion(PoseKnowledge knowledge) {
  knowledge.motion.angular_velocity.setZero();
  knowledge.motion.zoom_rate = 0;
  knowledge.motion.line_delay = 0;
  knowledge.motion_doubt = kUnknownMotion;
  return knowledge;
}

Vector4<double> error_of(const PicturePose& pose, const SeenPicture& picture) {
  Vector4<double> out;
  out << log_so3(
      Matrix3<double>(picture.base_from_camera(0).transpose() * pose.R_base_from_camera)),
      pose.log_f - std::log(picture.focal_length);
  return out;
}

struct MovingTrials {
  int found = 0;
  double squares = 0;  // normalised, by the covariance without its inflation
  Vector4<double> sum = Vector4<double>::Zero();  // of errors in their sigmas
  Vector4<double> sum_of_squares = Vector4<double>::Zero();
  double log_f_sigma = 0;  // mean
  double worst = 0;        // the largest normalised square

  void add(const PicturePose& pose, const SeenPicture& picture) {
    const Vector4<double> error = error_of(pose, picture);
    const double inflation = std::max(1.0, pose.noise_scale * pose.noise_scale);
    const Matrix4<double> covariance = pose.covariance / inflation;
    const double square = error.dot(covariance.ldlt().solve(error));
    const Vector4<double> in_sigmas = error.cwiseQuotient(covariance.diagonal().cwiseSqrt());
    ++found;
    squares += square;
    worst = std::max(worst, square);
    sum += in_sigmas;
    sum_of_squares += in_sigmas.cwiseAbs2();
    log_f_sigma += std::sqrt(covariance(3, 3)) / kPictures;
  }

  // As in picture_pose_test.cpp: chi-square, 4 sigmas of the mean, 3 % for Huber's weights and the gate.
  void expect_honest() const {
    EXPECT_EQ(found, kPictures);
    const double n = found;
    const auto expect_mean = [](double mean, double numbers) {
      const double wide = 4 * std::sqrt(2 / numbers);
      EXPECT_GT(mean, 1 - wide);
      EXPECT_LT(mean, 1.03 + wide);
    };
    expect_mean(squares / (n * kUnknowns), n * kUnknowns);
    for (int i = 0; i < kUnknowns; ++i) {
      SCOPED_TRACE(i);
      expect_mean(sum_of_squares[i] / n, n);
      EXPECT_LT(std::abs(sum[i]) / std::sqrt(n), 4);
    }
  }
};

template <class Told>
MovingTrials run_moving(const MotionCase& motion, double f, const Told& told) {
  MovingTrials out;
  std::mt19937_64 random(static_cast<std::uint64_t>(f));
  std::uniform_real_distribution<double> part(-1, 1);
  for (int i = 0; i < kPictures; ++i) {
    const SeenPicture picture = moving_picture(motion, f, kPi * part(random), 1.2 * part(random));
    SimulatedMatches what;
    what.wrong = 12;
    const std::vector<PoseMatch> matches = simulate(picture, what, &random);
    const PicturePose pose = find_pose(matches, told(knowledge_of(picture)));
    if (pose.status == PoseStatus::kOk) out.add(pose, picture);
  }
  return out;
}

TEST(MovingPicture, OfAnUnknownMotionIsAsGoodAsItSays) {
  for (const MotionCase& motion : motions()) {
    // Each motion at one of two focal lengths, in turn.
    const double f = &motion - motions().data() < 4 ? 1200 : 6000;
    SCOPED_TRACE(motion.name);
    run_moving(motion, f, [](const PoseKnowledge& k) { return without_motion(k); }).expect_honest();
  }
}

// The map may have no mount, and roll, then, may change, too.
TEST(MovingPicture, WithoutAMountIsAsGoodAsItSays) {
  run_moving(motions()[2], 3000, [](const PoseKnowledge& k) {
    PoseKnowledge out = without_motion(k);
    out.turned_by.reset();
    return out;
  }).expect_honest();
}

// Told rates with an error that is told, too, are weighed by it: better than none, as honest.
TEST(MovingPicture, TelemetrysRatesAreWeighed) {
  constexpr double kTurnSigma_px = 0.01, kZoomSigma = 2e-5;
  constexpr double f = 3000;
  std::mt19937_64 random(9);
  const auto told = [&random](const PoseKnowledge& k) {
    std::normal_distribution<double> normal;
    PoseKnowledge out = k;
    const double read_out_s = std::abs(k.motion.line_delay) * k.lens.height();
    // Errors of the mount's two rates.
    Matrix<double, 3, 2> J;
    const PanTilt<double> angle;
    (void)R_base_from_camera(*k.turned_by, angle, &J);
    const double sigma = kTurnSigma_px / f / read_out_s;
    out.motion.angular_velocity +=
        J * Vector2<double>(sigma * normal(random), sigma * normal(random));
    out.motion.zoom_rate += kZoomSigma / read_out_s * normal(random);
    out.motion_doubt = {kTurnSigma_px / f, kZoomSigma};
    return out;
  };
  const MovingTrials with = run_moving(motions()[1], f, told);
  with.expect_honest();
  const MovingTrials without =
      run_moving(motions()[1], f, [](const PoseKnowledge& k) { return without_motion(k); });
  // A slow motion, as the axes are not known exactly: a fast one leaves more doubt than telemetry takes away.
  EXPECT_LT(with.log_f_sigma, 0.93 * without.log_f_sigma);
}

// What is not known of the motion costs what so many unknowns cost, and no more; where the motion is known nothing changes.
TEST(MovingPicture, AtRestIsHardlyLessWellKnown) {
  const auto as_told = [](const PoseKnowledge& k) { return k; };
  const auto untold = [](const PoseKnowledge& k) { return without_motion(k); };
  const MovingTrials known = run_moving(motions()[0], 3000, as_told);
  known.expect_honest();
  const MovingTrials unknown = run_moving(motions()[0], 3000, untold);
  // A tilt's rate stretches the picture's height: f is left to its width, which has more than half of what tells it.
  EXPECT_LT(unknown.log_f_sigma, 1.3 * known.log_f_sigma);
}

// Beyond what any head does: a picture is found or refused, and never believed elsewhere.
TEST(MovingPicture, OfAWildMotionIsFoundOrRefused) {
  for (const MotionCase& motion :
       {MotionCase{"pan", 6, 0, 0, 30e-6}, MotionCase{"all", 3, -2, 3, 30e-6},
        MotionCase{"zoom", 0, 0, 8, -30e-6}}) {
    SCOPED_TRACE(motion.name);
    const MovingTrials trials =
        run_moving(motion, 3000, [](const PoseKnowledge& k) { return without_motion(k); });
    // Chi-square of four: one in 1e7 is larger.
    EXPECT_LT(trials.worst, 40);
  }
}

TEST(MovingPicture, NeverBelievesWrongMatchesAlone) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 20; ++i) {
    const SeenPicture picture =
        moving_picture(motions()[2], i % 2 == 0 ? 1200 : 24000, 0.1 * i, 0.2);
    SimulatedMatches what;
    what.right = 0;
    what.wrong = i < 10 ? 60 : 250;
    EXPECT_NE(
        find_pose(simulate(picture, what, &random), without_motion(knowledge_of(picture))).status,
        PoseStatus::kOk)
        << i;
  }
}

}  // namespace
}  // namespace alidade::test

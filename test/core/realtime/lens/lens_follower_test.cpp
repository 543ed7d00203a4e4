// The lens that has left the map's, against draws of how it moves, of what its reading says and of what landmarks see.

#include "core/realtime/lens/lens_follower.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <utility>

namespace alidade::test {
namespace {

constexpr double kFrame_s = 0.04;
constexpr double kRepeatability = 2e-3;
constexpr double kSeen = 2e-5;            // of log f, by a frame's landmarks
constexpr double kRateSeen = 5e-3;        // 1/s
constexpr double kMapFocalLength = 2000;  // px

Calibration curve_at(double focal_length) {
  Calibration out;
  out.camera = {focal_length, 1, {0}, 1280, 720, 3, -2};
  out.camera.distortion.radial = -0.02 * std::pow(focal_length / std::hypot(640, 360), 2);
  out.line_delay = 30e-6;
  const auto set = [&out](Parameter p, double sigma) {
    out.covariance(index(p), index(p)) = sigma * sigma;
  };
  set(Parameter::kFocalLength, kRepeatability * focal_length);
  set(Parameter::kRadialDistortion, 0.02 * std::abs(out.camera.distortion.radial));
  set(Parameter::kCentreU, 0.2);
  set(Parameter::kCentreV, 0.2);
  return out;
}

FrameLens told(double focal_length, bool moves = false, double rate = 0) {
  FrameLens out;
  out.calibration = curve_at(focal_length);
  out.moves = moves;
  out.rate = rate;
  out.rate_sigma = 0.1;
  return out;
}

double corner(const Camera<double>& camera) {
  return camera.distortion.radial / std::pow(camera.focal_length, 2);
}

double log_variance(const Calibration& calibration) {
  return std::pow(relative_focal_length_sigma(calibration), 2);
}

class FollowedLens : public testing::Test {
 protected:
  FollowedLens() { follower_.begin(kMapFocalLength); }

  void follow() { follower_.follow(0, kMapFocalLength); }
  // What is expected of a frame, by the frames before.
  void expect(double time_s, const FrameLens* reading, bool may_move = true) {
    follower_.begin_frame(reading);
    camera_ = follower_.expect_after_last(time_s, may_move, scale_, camera_);
    follower_.look_through(scale_, camera_);
  }
  // Landmarks saw this l (log f, its rate), and this well.
  OwnLens learn(double time_s, const Vector2<double>& l) {
    const ZoomPrior prior = follower_.prior(camera_, 0);
    Matrix2<double> noise = Matrix2<double>::Zero();
    noise.diagonal() << kSeen * kSeen, kRateSeen * kRateSeen;
    const Matrix2<double> gain = prior.covariance * (prior.covariance + noise).inverse();
    const Vector2<double> seen = l - Vector2<double>(std::log(camera_.focal_length), 0);
    SolvedZoom zoom;
    zoom.correction = prior.value + gain * (seen - prior.value);
    zoom.covariance = prior.covariance - gain * prior.covariance;
    camera_ = zoomed(camera_, zoom.correction[0]);
    follower_.look_through(scale_, camera_);
    return follower_.learn(time_s, zoom, camera_.focal_length, zoom.correction[1], scale_);
  }
  [[nodiscard]] Calibration answer(const OwnLens& own) const {
    Calibration calibration = curve_at(kMapFocalLength);
    calibration.camera = camera_;
    return follower_.answer(calibration, own, scale_, scale_.value, scale_.variance,
                            scale_.sensitivity);
  }

  LensFollower follower_{LensFollowerOptions{}};
  LensScale scale_ = LensScale::begin(curve_at(kMapFocalLength));
  Camera<double> camera_ = curve_at(kMapFocalLength).camera;
};

TEST_F(FollowedLens, IsTheMapsUntilItLeavesThat) {
  EXPECT_FALSE(follower_.follows());
  EXPECT_EQ(follower_.columns(), nullptr);
  follower_.begin_frame(nullptr);
  EXPECT_FALSE(follower_.reads_other_than(kMapFocalLength));
  const FrameLens same = told(kMapFocalLength);
  follower_.begin_frame(&same);
  EXPECT_FALSE(follower_.reads_other_than(kMapFocalLength));
  const FrameLens moves = told(kMapFocalLength, true);
  follower_.begin_frame(&moves);
  EXPECT_TRUE(follower_.reads_other_than(kMapFocalLength));
  const FrameLens other = told(1.1 * kMapFocalLength);
  follower_.begin_frame(&other);
  EXPECT_TRUE(follower_.reads_other_than(kMapFocalLength));
  follow();
  EXPECT_TRUE(follower_.follows());
  expect(kFrame_s, &other);
  EXPECT_NE(follower_.columns(), nullptr);
  follower_.give_up();
  EXPECT_FALSE(follower_.follows());
  EXPECT_EQ(follower_.columns(), nullptr);
}

// The answer's focal length, the map's scale in it, while the lens moves and after.
TEST_F(FollowedLens, ErrsAsItsAnswerSays) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  constexpr int kRuns = 200;
  constexpr int kFrames = 40;
  constexpr int kMoving = 25;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    follower_ = LensFollower{LensFollowerOptions{}};
    follower_.begin(kMapFocalLength);
    camera_ = curve_at(kMapFocalLength).camera;
    follow();
    const double phi = kRepeatability * normal(random);
    Vector2<double> truth(std::log(kMapFocalLength), 0);  // at phi = 0
    const double speed = normal(random);
    for (int k = 1; k <= kFrames; ++k) {
      const double rate = k <= kMoving ? speed * std::min(1.0, k / 10.0) : 0;
      truth[0] += kFrame_s * (rate + truth[1]) / 2;
      truth[1] = rate;
      const FrameLens reading =
          told(std::exp(truth[0] + phi + kRepeatability * normal(random)), k <= kMoving, rate);
      expect(k * kFrame_s, &reading, !follower_.at_rest());
      const OwnLens learnt =
          learn(k * kFrame_s,
                truth + Vector2<double>(kSeen * normal(random), kRateSeen * normal(random)));
      const Calibration found = answer(learnt);
      const double error = std::log(found.camera.focal_length) - (truth[0] + phi);
      squares += error * error / log_variance(found) / (kRuns * kFrames);
      // As exact as the map's scale, not as the reading.
      EXPECT_LT(relative_focal_length_sigma(found), 1.1 * kRepeatability);
    }
    EXPECT_TRUE(follower_.at_rest());
  }
  // A run is one draw of phi: four standard deviations of the mean of so many chi-squares.
  EXPECT_NEAR(squares, 1, 4 * std::sqrt(2.0 / kRuns));
}

TEST_F(FollowedLens, TakesTheReadingWhereThatTellsMore) {
  follow();
  FrameLens reading = told(1.01 * kMapFocalLength, true, 0.3);
  expect(kFrame_s, &reading);
  // 2 /s^2 in a frame: 0.16 %.
  EXPECT_FALSE(follower_.reading_tells_more(kFrame_s));
  expect(5 * kFrame_s, &reading);
  EXPECT_TRUE(follower_.reading_tells_more(5 * kFrame_s));
  scale_.value = 1e-3;
  const Camera<double> camera = follower_.expect_by_reading(scale_);
  EXPECT_NEAR(camera.focal_length * std::exp(scale_.value), 1.01 * kMapFocalLength, 1e-9);
  EXPECT_NEAR(corner(camera) / corner(reading.calibration.camera), 1, 1e-12);
  EXPECT_NEAR(follower_.expected().value[0], std::log(camera.focal_length), 1e-12);
  EXPECT_EQ(follower_.expected().value[1], 0.3);
  EXPECT_NEAR(follower_.expected().covariance(0, 0),
              log_variance(reading.calibration) + scale_.variance, 1e-15);
}

// A reading in steps of some per cent has them at another focal length.
TEST_F(FollowedLens, HasDistortionAndCentreOfTheFocalLengthThatIsSeen) {
  constexpr double kStep = 0.02;  // of log f, one standard deviation
  follow();
  FrameLens reading = told(1.03 * kMapFocalLength, true);
  const Camera<double>& of_reading = reading.calibration.camera;
  reading.calibration.covariance(0, 0) = std::pow(kStep * of_reading.focal_length, 2);
  reading.corner_by_zoom[0] = 0.05;
  reading.centre_by_zoom = {4, -2};
  scale_.value = 1e-3;
  follower_.begin_frame(&reading);
  // Followed as far as the reading may err.
  const double told_log_f = std::log(of_reading.focal_length);
  for (const auto& [change, followed] :
       {std::pair{-0.03, -0.03}, std::pair{0.05, 0.05}, std::pair{1.0, 5 * kStep}}) {
    const double log_f = told_log_f - scale_.value + change;
    const Camera<double> camera = follower_.with_focal_length(log_f, scale_, camera_);
    EXPECT_NEAR(std::log(camera.focal_length), log_f, 1e-12);
    EXPECT_NEAR(corner_distortion(camera)[0], corner_distortion(of_reading)[0] + 0.05 * followed,
                1e-12);
    EXPECT_NEAR(camera.centre_u, of_reading.centre_u + 4 * followed, 1e-12);
    EXPECT_NEAR(camera.centre_v, of_reading.centre_v - 2 * followed, 1e-12);
  }
  follower_.begin_frame(nullptr);
  const Camera<double> camera = follower_.with_focal_length(told_log_f, scale_, camera_);
  EXPECT_NEAR(corner(camera) / corner(camera_), 1, 1e-12);
  EXPECT_EQ(camera.centre_u, camera_.centre_u);
}

TEST_F(FollowedLens, SaysThatLandmarksExcludeTheReading) {
  scale_.variance = 1e-12;
  for (const double sigmas : {4.0, 6.0}) {
    follower_.begin(kMapFocalLength);
    camera_ = curve_at(kMapFocalLength).camera;
    follow();
    const FrameLens reading = told(kMapFocalLength * std::exp(sigmas * kRepeatability), true);
    expect(kFrame_s, &reading);
    EXPECT_NEAR(learn(kFrame_s, {std::log(kMapFocalLength), 0}).reading_sigmas, sigmas, 0.05);
    // Half a second later the frames before tell less than the reading, but for that it is wrong.
    const bool excluded = sigmas > 5;
    const double later_s = 10 * kFrame_s;
    expect(later_s, &reading);
    EXPECT_EQ(follower_.reading_tells_more(later_s), !excluded);
    Calibration unseen = curve_at(kMapFocalLength);
    follower_.answer_unseen(later_s, scale_, camera_, &unseen);
    const double told_f = reading.calibration.camera.focal_length;
    EXPECT_NEAR(unseen.camera.focal_length,
                excluded ? camera_.focal_length * std::exp(scale_.value) : told_f, 1e-9);
    EXPECT_NEAR(relative_focal_length_sigma(unseen),
                excluded ? std::sqrt(follower_.expected().covariance(0, 0) + scale_.variance)
                         : kRepeatability,
                1e-12);
    // What was seen long ago excludes nothing.
    EXPECT_TRUE(follower_.reading_tells_more(20 * kFrame_s));
  }
}

TEST_F(FollowedLens, IsKnownForAWhileWithoutAReading) {
  follow();
  expect(kFrame_s, nullptr);
  EXPECT_TRUE(follower_.is_known(kFrame_s));
  EXPECT_FALSE(follower_.is_known(1));
  EXPECT_FALSE(follower_.reading_tells_more(1));
  Calibration answer = curve_at(1500);
  follower_.answer_unseen(1, scale_, camera_, &answer);
  EXPECT_EQ(answer.camera.focal_length, 1500) << "nothing tells better than the answer before";
  const FrameLens reading = told(kMapFocalLength);
  expect(1, &reading);
  EXPECT_TRUE(follower_.is_known(1));
}

TEST_F(FollowedLens, StandsAfterThreeFramesWithoutARate) {
  follow();
  const FrameLens rests = told(kMapFocalLength);
  const FrameLens moves = told(kMapFocalLength, true);
  double l = std::log(kMapFocalLength);
  int k = 0;
  const auto frame = [&](const FrameLens& reading, double rate) {
    ++k;
    l += kFrame_s * rate;
    expect(k * kFrame_s, &reading, !follower_.at_rest());
    static_cast<void>(learn(k * kFrame_s, {l, rate}));
  };
  frame(rests, 0);
  frame(rests, 0);
  EXPECT_FALSE(follower_.at_rest());
  EXPECT_TRUE(follower_.moves());
  frame(rests, 0);
  EXPECT_TRUE(follower_.at_rest());
  EXPECT_FALSE(follower_.moves());
  follower_.begin_frame(&moves);
  EXPECT_FALSE(follower_.at_rest()) << "its reading says so";
  for (int i = 0; i < 3; ++i) frame(rests, 0);
  EXPECT_TRUE(follower_.at_rest());
  follower_.note_movement();
  EXPECT_FALSE(follower_.at_rest());
  for (int i = 0; i < 5; ++i) frame(rests, 8 * kRateSeen);
  EXPECT_FALSE(follower_.at_rest()) << "landmarks say so";
}

TEST_F(FollowedLens, DoubtsDistortionAndCentreWithoutAReading) {
  follow();
  Vector2<double> truth(std::log(kMapFocalLength), 0);
  OwnLens learnt;
  for (int k = 1; k <= 40; ++k) {
    const double rate = 0.04 * std::min(k, 40 - k);
    truth[0] += kFrame_s * (truth[1] + rate) / 2;
    truth[1] = rate;
    expect(k * kFrame_s, nullptr);
    learnt = learn(k * kFrame_s, truth);
  }
  const double far = truth[0] - std::log(kMapFocalLength);
  ASSERT_NEAR(far, 0.64, 1e-9);
  const Calibration blind = answer(learnt);
  const FrameLens reading = told(camera_.focal_length);
  follower_.begin_frame(&reading);
  const Calibration read = answer(learnt);
  const auto more = [&](Parameter p) {
    return std::sqrt(blind.covariance(index(p), index(p)) - read.covariance(index(p), index(p)));
  };
  const LensFollowerOptions options;
  const double of_corner = std::pow(camera_.focal_length / std::hypot(640, 360), 2);
  const double unknown = options.distortion_change * far;
  EXPECT_NEAR(more(Parameter::kCentreU), options.centre_change_px * far, 1e-3);
  EXPECT_NEAR(more(Parameter::kCentreV), options.centre_change_px * far, 1e-3);
  // Of the corner itself, and of log f, which takes the corner's 2 % along.
  EXPECT_NEAR(more(Parameter::kRadialDistortion) / of_corner, unknown * std::hypot(1, 2 * 0.02),
              1e-3 * unknown);
  EXPECT_NEAR(log_variance(blind) - log_variance(read), unknown * unknown,
              1e-3 * unknown * unknown);
  // Where the map is begun anew with the lens that it is, none of that is unknown.
  follower_.begin(camera_.focal_length);
  follower_.begin_frame(nullptr);
  follower_.look_through(scale_, camera_);
  const Calibration anew = answer(learnt);
  EXPECT_NEAR(anew.covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)),
              read.covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)), 1e-12);
  EXPECT_NEAR(log_variance(anew), log_variance(read), 1e-15);
}

// In f, too, which a distortion that is off passes for; and as long as landmarks made there are in the map.
TEST_F(FollowedLens, DoubtsDistortionAndCentreAsTheCurveDidWhereLandmarksWereMade) {
  constexpr double kUnknown = 0.01;   // in the corner, part of its distance
  constexpr double kUnknown_px = 3;   // of the centre
  constexpr double kByCentre = 1e-3;  // of log f, for each px of the centre
  const auto answer_after = [&](bool vague) {
    follower_.begin(kMapFocalLength);
    camera_ = curve_at(kMapFocalLength).camera;
    follow();
    FrameLens reading = told(kMapFocalLength, true);
    const Calibration& sharp = reading.calibration;
    const ParameterCovariance<double> of_curve = sharp.covariance;
    if (vague) {
      const double of_corner = corner_unit(sharp.camera)[0];
      const int of_k = index(Parameter::kRadialDistortion);
      reading.calibration.covariance(of_k, of_k) += std::pow(kUnknown * of_corner, 2);
      const int of_u = index(Parameter::kCentreU);
      reading.calibration.covariance(of_u, of_u) += kUnknown_px * kUnknown_px;
    }
    const Vector2<double> l(std::log(kMapFocalLength), 0);
    expect(kFrame_s, &reading);
    static_cast<void>(learn(kFrame_s, l));
    reading.calibration.covariance = of_curve;
    expect(2 * kFrame_s, &reading);
    OwnLens own = learn(2 * kFrame_s, l);
    own.sensitivity(0, index(Parameter::kCentreU)) = kByCentre;
    return answer(own);
  };
  const Calibration sharp = answer_after(false);
  const Calibration vague = answer_after(true);
  const auto more = [&](Parameter p) {
    return std::sqrt(vague.covariance(index(p), index(p)) - sharp.covariance(index(p), index(p)));
  };
  EXPECT_NEAR(more(Parameter::kCentreU), kUnknown_px, 0.01 * kUnknown_px);
  EXPECT_EQ(vague.covariance(index(Parameter::kCentreV), index(Parameter::kCentreV)),
            sharp.covariance(index(Parameter::kCentreV), index(Parameter::kCentreV)));
  const double of_corner = corner_unit(sharp.camera)[0];
  EXPECT_NEAR(more(Parameter::kRadialDistortion) / of_corner, kUnknown, 0.02 * kUnknown);
  EXPECT_NEAR(std::sqrt(log_variance(vague) - log_variance(sharp)),
              std::hypot(kUnknown, kByCentre * kUnknown_px), 0.02 * kUnknown);
}

TEST_F(FollowedLens, IsGivenUpAfterFramesWithoutLandmarksWhereItsReadingStands) {
  follow();
  const FrameLens rests = told(1.3 * kMapFocalLength);
  const FrameLens moves = told(1.3 * kMapFocalLength, true);
  const int frames = LensFollowerOptions{}.frames_lost_for_good;
  for (int k = 1; k <= frames; ++k) {
    EXPECT_FALSE(follower_.is_lost_for_good()) << k;
    expect(k * kFrame_s, &rests);
    follower_.note_lost();
  }
  EXPECT_TRUE(follower_.is_lost_for_good());
  follower_.begin_frame(&moves);
  EXPECT_FALSE(follower_.is_lost_for_good());
  follower_.begin_frame(nullptr);
  EXPECT_FALSE(follower_.is_lost_for_good());
  expect(frames * kFrame_s, &rests);
  static_cast<void>(learn(frames * kFrame_s, {std::log(kMapFocalLength), 0}));
  EXPECT_FALSE(follower_.is_lost_for_good()) << "landmarks hold";
}

}  // namespace
}  // namespace alidade::test

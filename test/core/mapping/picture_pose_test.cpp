#include "core/mapping/picture_pose.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "test/core/mapping/seen_picture.h"

namespace alidade::test {
namespace {

struct Trials {
  int poses = 0;
  Eigen::Vector4d sum =
      Eigen::Vector4d::Zero();  // of standardised errors: pan, tilt, log f or xi, log f
  double squares = 0;           // normalised, by the covariance without its inflation
  double inflated_squares = 0;
  int unknowns = 0;
  int wrong_inliers = 0;
  int missed = 0;
};

// `count` pictures, each with a pose and matches of its own.
Trials run(double focal_length, const SimulatedMatches& what, bool with_mount, int count) {
  Trials out;
  out.unknowns = with_mount ? 3 : 4;
  std::mt19937_64 random(static_cast<std::uint64_t>(focal_length) +
                         static_cast<std::uint64_t>(what.wrong));
  std::uniform_real_distribution<double> part(-1, 1);
  for (int i = 0; i < count; ++i) {
    const SeenPicture picture =
        lively_picture(focal_length, kPi * part(random), 1.3 * part(random), 0.1 * part(random));
    const std::vector<PoseMatch> matches = simulate(picture, what, &random);
    const PoseKnowledge knowledge = picture.knowledge(with_mount);
    const PicturePose pose = find_pose(matches, knowledge);
    if (pose.status != PoseStatus::kOk) {
      ADD_FAILURE() << to_string(pose.status) << ", f " << focal_length << ", " << i;
      continue;
    }
    const double inflation = std::max(1.0, pose.noise_scale * pose.noise_scale);
    Eigen::VectorXd error(out.unknowns);
    Eigen::MatrixXd covariance;
    error[out.unknowns - 1] = pose.log_f - std::log(focal_length);
    if (with_mount) {
      error.head<2>() = minus(*pose.angle, PanTilt<double>{picture.pan, picture.tilt});
      Matrix<double, 3, 2> J;
      (void)R_base_from_camera(*knowledge.mechanics, *pose.angle, &J);
      Eigen::Matrix<double, 3, 4> angles_of_xi = Eigen::Matrix<double, 3, 4>::Zero();
      angles_of_xi.topLeftCorner<2, 3>() = (J.transpose() * J).inverse() * J.transpose();
      angles_of_xi(2, 3) = 1;
      covariance = angles_of_xi * pose.covariance * angles_of_xi.transpose();
    } else {
      error.head<3>() = log_so3(
          Matrix3<double>(picture.base_from_camera(0).transpose() * pose.R_base_from_camera));
      covariance = pose.covariance;
    }
    const double square = error.dot(covariance.inverse() * error);
    out.inflated_squares += square;
    out.squares += square * inflation;
    for (int j = 0; j < out.unknowns; ++j)
      out.sum[j] += error[j] / std::sqrt(covariance(j, j) / inflation);
    for (const int inlier : pose.inliers) out.wrong_inliers += inlier >= what.right ? 1 : 0;
    int right = 0;
    for (const int inlier : pose.inliers) right += inlier < what.right ? 1 : 0;
    out.missed += what.right - right;
    ++out.poses;
  }
  return out;
}

// Normalised errors squared are chi-square: mean `unknowns`, variance 2 `unknowns`; 4 sigmas of the mean. Huber's weights and the
// gate cost at the most 3 % of the variance; wrong matches that fall within the gate add less.
void expect_honest(const Trials& trials) {
  const double n = trials.poses;
  const double anees = trials.squares / (n * trials.unknowns);
  const double wide = 4 * std::sqrt(2 / (n * trials.unknowns));
  EXPECT_GT(anees, 1 - wide);
  EXPECT_LT(anees, 1.03 + wide);
  for (int j = 0; j < trials.unknowns; ++j)
    EXPECT_LT(std::abs(trials.sum[j]) / std::sqrt(n), 4) << j;
}

TEST(PicturePose, IsUnbiasedAndAsGoodAsItSays) {
  for (const double f : {1200.0, 24000.0}) {
    for (const int wrong : {34, 80}) {  // 30 and 50 %
      SCOPED_TRACE(std::to_string(f) + ", wrong: " + std::to_string(wrong));
      SimulatedMatches what;
      what.wrong = wrong;
      const Trials trials = run(f, what, true, 60);
      ASSERT_EQ(trials.poses, 60);
      expect_honest(trials);
      // A wrong match lies within the gate, 4 sigmas of 0.22 px, by 2.6e-6 of the image; a right one outside by 3.4e-4.
      EXPECT_LE(trials.wrong_inliers, 2);
      EXPECT_LE(trials.missed, 12);
    }
  }
}

TEST(PicturePose, WithoutAMountFindsRollToo) {
  SimulatedMatches what;
  what.wrong = 34;
  const Trials trials = run(5000, what, false, 60);
  ASSERT_EQ(trials.poses, 60);
  expect_honest(trials);
}

TEST(PicturePose, CountsNoiseThatIsLargerThanClaimed) {
  SimulatedMatches what;
  what.sigma_px = 0.3;
  what.claimed_px = 0.15;
  what.landmark_sigma_px = 0;
  const Trials trials = run(5000, what, true, 60);
  ASSERT_EQ(trials.poses, 60);
  const double n = 3 * 60;
  // The scale is itself measured, of 160 numbers: its square by 2/160 of the mean, and the median's start a little more.
  EXPECT_GT(trials.inflated_squares / n, 1 - 4 * std::sqrt(2 / n));
  EXPECT_LT(trials.inflated_squares / n, 1.05 + 4 * std::sqrt(2 / n));
}

// Its uncertain motion has hardly a part about the optical axis, which lies across both axes here.
TEST(PicturePose, AMountTurnsAboutItsAxesAlone) {
  constexpr double kTurn_rad = 2e-4;
  SeenPicture picture;
  picture.pan = 0.4;
  picture.focal_length = 5000;
  picture.line_delay = 3e-5;
  PoseKnowledge knowledge = picture.knowledge(true);
  knowledge.motion_doubt = {kTurn_rad, 1e-4};
  std::mt19937_64 random(11);
  const PicturePose pose = find_pose(simulate(picture, {}, &random), knowledge);
  ASSERT_EQ(pose.status, PoseStatus::kOk);
  // 80 matches of 0.2 px at 300 px from the middle would leave 7e-5 rad.
  EXPECT_LT(std::sqrt(pose.motion_covariance(2, 2)), 0.03 * kTurn_rad);
  EXPECT_GT(std::sqrt(pose.motion_covariance(0, 0)), 0.01 * kTurn_rad);
}

TEST(PicturePose, OfNoneOneOrTwoMatchesThereIsNone) {
  const SeenPicture picture = lively_picture(5000, 1, 0.2, 0);
  std::mt19937_64 random(3);
  for (const int count : {0, 1, 2}) {
    SimulatedMatches what;
    what.right = count;
    const std::vector<PoseMatch> matches = simulate(picture, what, &random);
    EXPECT_EQ(find_pose(matches, picture.knowledge(true)).status, PoseStatus::kTooFewMatches);
    PoseOptions of_two;
    of_two.least_inliers = 0;
    EXPECT_NE(find_pose(matches, picture.knowledge(true), of_two).status, PoseStatus::kOk) << count;
  }
}

TEST(PicturePose, NeverBelievesWrongMatchesAlone) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 40; ++i) {
    const SeenPicture picture = lively_picture(i % 2 == 0 ? 1200 : 24000, 0.1 * i, 0.2, 0);
    SimulatedMatches what;
    what.right = 0;
    what.wrong = i < 20 ? 60 : 250;
    EXPECT_NE(find_pose(simulate(picture, what, &random), picture.knowledge(i % 4 < 2)).status,
              PoseStatus::kOk)
        << i;
  }
}

// The windows of a facade: each match may have landed on the next one.
TEST(PicturePose, RefusesRepeatedTexture) {
  std::mt19937_64 random(5);
  for (const double share : {0.36, 0.5}) {
    for (int i = 0; i < 5; ++i) {
      const SeenPicture picture = lively_picture(3000, -2 + i, 0.1 * i, 0);
      std::vector<PoseMatch> matches = simulate(picture, {}, &random);
      SeenPicture next = picture;
      next.pan += 90 / picture.focal_length;
      const auto shifted = static_cast<std::size_t>(share * static_cast<double>(matches.size()));
      for (std::size_t j = 0; j < shifted; ++j) {
        const auto u = picture.seen(matches[j].d_b);
        ASSERT_TRUE(u);
        matches[j].d_b = next.direction_of(*u);
      }
      EXPECT_EQ(find_pose(matches, picture.knowledge(true)).status, PoseStatus::kRival)
          << share << ", " << i;
    }
  }
}

TEST(PicturePose, RefusesMatchesInOneSpotOrLine) {
  const SeenPicture picture = lively_picture(5000, 1, 0.2, 0);
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  const auto matches_at = [&](double spread_u, double spread_v) {
    std::vector<PoseMatch> out;
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector2d u(700 + spread_u * normal(random), 300 + spread_v * normal(random));
      PoseMatch match;
      match.d_b = picture.direction_of(u);
      match.u = u + 0.2 * Eigen::Vector2d(normal(random), normal(random));
      out.push_back(match);
    }
    return out;
  };
  ASSERT_EQ(find_pose(matches_at(150, 100), picture.knowledge(true)).status, PoseStatus::kOk);
  EXPECT_EQ(find_pose(matches_at(12, 12), picture.knowledge(true)).status, PoseStatus::kOneSpot);
  EXPECT_EQ(find_pose(matches_at(200, 2), picture.knowledge(true)).status, PoseStatus::kCollinear);
}

TEST(PicturePose, TakesAPriorOfTheFocalLength) {
  const SeenPicture picture = lively_picture(5000, 1, 0.2, 0);
  std::mt19937_64 random(7);
  const std::vector<PoseMatch> matches = simulate(picture, {}, &random);
  PoseKnowledge knowledge = picture.knowledge(true);
  const PicturePose without = find_pose(matches, knowledge);
  knowledge.focal_length = FocalLengthPrior{std::log(5000.0), 1e-6};
  const PicturePose with = find_pose(matches, knowledge);
  ASSERT_EQ(without.status, PoseStatus::kOk);
  ASSERT_EQ(with.status, PoseStatus::kOk);
  EXPECT_GT(std::sqrt(without.covariance(3, 3)), 1e-5);
  EXPECT_LT(std::sqrt(with.covariance(3, 3)), 1.1e-6);
  EXPECT_NEAR(with.log_f, std::log(5000.0), 2e-6);
  // One that is far off is not argued with.
  knowledge.focal_length = FocalLengthPrior{std::log(6500.0), 0.01};
  EXPECT_NE(find_pose(matches, knowledge).status, PoseStatus::kOk);
}

TEST(PicturePose, IgnoresMatchesThatAreNotNumbersAndIsTheSameEachTime) {
  const SeenPicture picture = lively_picture(5000, 1, 0.2, 0);
  std::mt19937_64 random(8);
  std::vector<PoseMatch> matches = simulate(picture, {}, &random);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  matches[3].u.x() = nan;
  matches[4].d_b.setConstant(nan);
  matches[5].d_b *= 2;
  matches[6].sigma_px = 0;
  matches[7].cov_d(0, 0) = nan;
  const PicturePose first = find_pose(matches, picture.knowledge(true));
  const PicturePose second = find_pose(matches, picture.knowledge(true));
  ASSERT_EQ(first.status, PoseStatus::kOk);
  for (const int inlier : first.inliers) EXPECT_TRUE(inlier < 3 || inlier > 7) << inlier;
  EXPECT_EQ(first.R_base_from_camera, second.R_base_from_camera);
  EXPECT_EQ(first.log_f, second.log_f);
  EXPECT_EQ(first.inliers, second.inliers);
}

}  // namespace
}  // namespace alidade::test

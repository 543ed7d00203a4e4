#include "core/mapping/landmark_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "test/core/mapping/seen_picture.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

constexpr double kSigma_px = 0.2;

// What Alidade knows of a picture when its pose is off by (xi, log f).
PosedPicture posed(const SeenPicture& picture, const Vector4<double>& off) {
  const PoseKnowledge knowledge = picture.knowledge(false);
  PosedPicture out;
  out.R_base_from_camera = picture.base_from_camera(0) * exp_so3(Vector3<double>(off.head<3>()));
  // A lens of which only f changes: k goes along, so that the corner's distortion stays.
  out.camera = knowledge.lens.camera_of(std::log(picture.focal_length) + off[3], &out.J_camera_log);
  out.motion = knowledge.motion;
  return out;
}

Matrix4<double> some_pose_covariance() {
  Matrix4<double> root;
  root << 1e-4, 0, 0, 0, 3e-5, 8e-5, 0, 0, 2e-4, -1e-4, 3e-4, 0, 1e-4, 5e-5, 0, 2e-4;
  return root * root.transpose();
}

Vector2<double> normal2(std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  const double x = normal(*random);
  return {x, normal(*random)};
}

TEST(LandmarkFilter, ItsJacobiansAreTheNumericOnes) {
  int evaluated = 0;
  for (const double fields : {0.0, 0.5}) {
    const SeenPicture picture = lively_picture(2500, 0.4, -0.2, fields);
    for (const Vector2<double>& place : {Vector2<double>(100, 90), Vector2<double>(900, 600)}) {
      const Vector3<double> d = picture.direction_of(place);
      const auto y_of = [&](const Vector2<double>& du, const Vector4<double>& off) {
        LandmarkSight sight;
        EXPECT_EQ(see_landmark(posed(picture, off), place + du, kSigma_px, d, &sight),
                  ProjectionStatus::kOk);
        return sight;
      };
      const LandmarkSight at = y_of({0, 0}, Vector4<double>::Zero());
      EXPECT_LT(at.y.norm() * picture.focal_length, 1e-3);
      const NumericFunction<2, 2> by_u = [&](const Vector2<double>& du) {
        return std::optional<Vector2<double>>(y_of(du, Vector4<double>::Zero()).y);
      };
      const NumericFunction<2, 4> by_pose = [&](const Vector4<double>& off) {
        return std::optional<Vector2<double>>(y_of({0, 0}, off).y);
      };
      const auto numeric_u = numeric_jacobian<2, 2>(by_u, 0.1);
      const auto numeric_pose = numeric_jacobian<2, 4>(by_pose, 1e-5);
      evaluated += numeric_u.evaluated + numeric_pose.evaluated;
      // y is 1e-7 at the beginning of each, by which the slope of G counts.
      EXPECT_LT((disagreement<2, 2>(at.J_y_u, numeric_u, 1e-12)), 5);
      EXPECT_LT((disagreement<2, 4>(at.J_y_pose, numeric_pose, 1e-12)), 50);
    }
  }
  EXPECT_EQ(evaluated, 4 * 24);
}

// Each of the three terms, and all together: 4000 draws of a pose, a detection and a landmark about the truth.
TEST(LandmarkFilter, Equation8IsTheCovarianceOf4000Draws) {
  constexpr int kDraws = 4000;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const SeenPicture picture = lively_picture(2500, 0.4, -0.2, 0.5);
  const Vector3<double> d = picture.direction_of({1000, 120});
  const Vector2<double> u = *picture.seen(d);
  Matrix2<double> cov_d;
  cov_d << 4e-9, -1e-9, -1e-9, 9e-9;
  const std::vector<Vector3<double>> cases{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  for (const Vector3<double>& terms : cases) {
    const Matrix4<double> root_pose = some_pose_covariance().llt().matrixL();
    const Matrix2<double> root_d = cov_d.llt().matrixL();
    PosedPicture known = posed(picture, Vector4<double>::Zero());
    known.cov_pose = terms[0] * some_pose_covariance();
    LandmarkSight sight;
    ASSERT_EQ(see_landmark(known, u, terms[1] * kSigma_px, d, &sight), ProjectionStatus::kOk);
    const Matrix2<double> claimed = innovation_covariance(sight, terms[2] * cov_d);
    const Matrix2<double> whiten = claimed.llt().matrixL().solve(Matrix2<double>::Identity());
    Matrix2<double> sum = Matrix2<double>::Zero();
    Vector2<double> mean = Vector2<double>::Zero();
    for (int i = 0; i < kDraws; ++i) {
      Vector4<double> n;
      for (int j = 0; j < 4; ++j) n[j] = normal(random);
      const PosedPicture estimated = posed(picture, terms[0] * root_pose * n);
      const Vector3<double> landmark =
          direction_plus<double>(d, terms[2] * root_d * normal2(&random));
      ASSERT_EQ(see_landmark(estimated, u + terms[1] * kSigma_px * normal2(&random), kSigma_px,
                             landmark, &sight),
                ProjectionStatus::kOk);
      const Vector2<double> z = whiten * sight.y;
      sum += z * z.transpose() / kDraws;
      mean += z / kDraws;
    }
    // Of normal z: five sigmas of a mean, of a variance, of a covariance.
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 / std::sqrt(kDraws)) << terms.transpose();
    EXPECT_LT(std::abs(sum(0, 0) - 1), 5 * std::sqrt(2.0 / kDraws)) << terms.transpose();
    EXPECT_LT(std::abs(sum(1, 1) - 1), 5 * std::sqrt(2.0 / kDraws)) << terms.transpose();
    EXPECT_LT(std::abs(sum(0, 1)), 5 / std::sqrt(kDraws)) << terms.transpose();
  }
}

TEST(LandmarkFilter, WithPosesOfItsOwnItIsAsUncertainAsItSays) {
  constexpr int kRuns = 400, kUpdates = 20;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const SeenPicture picture = lively_picture(2500, 0.4, -0.2, 0);
  const Vector3<double> d = picture.direction_of({300, 500});
  const Vector2<double> u = *picture.seen(d);
  const Matrix4<double> root_pose = some_pose_covariance().llt().matrixL();
  double nees = 0;
  for (int run = 0; run < kRuns; ++run) {
    const double sigma = 3e-4;
    LandmarkState state{direction_plus<double>(d, sigma * normal2(&random)),
                        sigma * sigma * Matrix2<double>::Identity(), Matrix2<double>::Zero()};
    for (int i = 0; i < kUpdates; ++i) {
      Vector4<double> n;
      for (int j = 0; j < 4; ++j) n[j] = normal(random);
      PosedPicture estimated = posed(picture, root_pose * n);
      estimated.cov_pose = some_pose_covariance();
      LandmarkSight sight;
      ASSERT_EQ(
          see_landmark(estimated, u + kSigma_px * normal2(&random), kSigma_px, state.d_b, &sight),
          ProjectionStatus::kOk);
      ASSERT_EQ(update_landmark(sight, Matrix2<double>::Zero(), 0, 1, 10, &state),
                LandmarkUpdate::kOk);
    }
    const Vector2<double> error = direction_minus(state.d_b, d);
    nees += error.dot(state.covariance.inverse() * error);
  }
  // Chi-square of 2 runs degrees of freedom, five sigmas.
  EXPECT_LT(std::abs(nees / (2 * kRuns) - 1), 5 * std::sqrt(1.0 / kRuns));
}

// The pose by least squares from the landmarks themselves, each with its own covariance, as find_pose() weighs them.
void find_pose_of(const SeenPicture& picture, const std::vector<LandmarkState>& landmarks,
                  const std::vector<Vector2<double>>& seen, PosedPicture* out) {
  Vector4<double> off = Vector4<double>::Zero();
  for (int step = 0; step < 3; ++step) {
    *out = posed(picture, off);
    Matrix4<double> N = Matrix4<double>::Zero();
    Vector4<double> b = Vector4<double>::Zero();
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      LandmarkSight sight;
      ASSERT_EQ(see_landmark(*out, seen[i], kSigma_px, landmarks[i].d_b, &sight),
                ProjectionStatus::kOk);
      const Matrix2<double> weight = (sight.cov_detection + landmarks[i].covariance).inverse();
      N += sight.J_y_pose.transpose() * weight * sight.J_y_pose;
      b += sight.J_y_pose.transpose() * weight * sight.y;
    }
    out->cov_pose = N.inverse();
    off -= out->cov_pose * b;
  }
}

struct Consistency {
  double nees = 0;         // mean over landmarks, 1 is honest
  double common_nees = 0;  // of the mean error in the view
  double own_sigma = 0;    // rad, mean at the end
};

// `updates` pictures of the same landmarks, each explained by them, each explaining them.
Consistency update_by_themselves(bool with_common_part, int updates) {
  constexpr int kRuns = 60, kLandmarks = 30;
  std::mt19937_64 random(9);
  const SeenPicture picture = lively_picture(2500, 0.4, -0.2, 0);
  Consistency out;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Vector3<double>> truth;
    std::vector<LandmarkState> landmarks;
    std::vector<Vector2<double>> u;
    for (int i = 0; i < kLandmarks; ++i) {
      u.emplace_back(80.0 + (i % 6) * 220, 80.0 + (i / 6) * 130.0);
      truth.push_back(picture.direction_of(u.back()));
      const double sigma = 1.5 * kSigma_px / picture.focal_length;
      landmarks.push_back({direction_plus<double>(truth.back(), sigma * normal2(&random)),
                           sigma * sigma * Matrix2<double>::Identity(), Matrix2<double>::Zero()});
    }
    for (int k = 0; k < updates; ++k) {
      std::vector<Vector2<double>> seen;
      for (const Vector2<double>& place : u)
        seen.emplace_back(place + kSigma_px * normal2(&random));
      PosedPicture estimated;
      find_pose_of(picture, landmarks, seen, &estimated);
      Matrix4<double> N = Matrix4<double>::Zero(), S = Matrix4<double>::Zero();
      Matrix2<double> common = Matrix2<double>::Zero();
      std::vector<LandmarkSight> sights(landmarks.size());
      for (std::size_t i = 0; i < landmarks.size(); ++i) {
        EXPECT_EQ(see_landmark(estimated, seen[i], kSigma_px, landmarks[i].d_b, &sights[i]),
                  ProjectionStatus::kOk);
        const Matrix2<double> weight =
            (sights[i].cov_detection + landmarks[i].covariance).inverse();
        const Matrix<double, 2, 4> weighted = weight * sights[i].J_y_pose;
        N += sights[i].J_y_pose.transpose() * weighted;
        S += weighted.transpose() * landmarks[i].covariance * weighted;
        common += landmarks[i].shared_covariance / kLandmarks;
      }
      const double share = (S * estimated.cov_pose).trace() / (N * estimated.cov_pose).trace();
      for (std::size_t i = 0; i < landmarks.size(); ++i) {
        static_cast<void>(update_landmark(sights[i],
                                          with_common_part ? common : Matrix2<double>::Zero(),
                                          with_common_part ? share : 0, 1, 10, &landmarks[i]));
      }
    }
    Vector2<double> mean = Vector2<double>::Zero();
    Matrix2<double> common = Matrix2<double>::Zero(), own = Matrix2<double>::Zero();
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const Vector2<double> error = direction_minus(landmarks[i].d_b, truth[i]);
      const Matrix2<double> whole = landmarks[i].covariance + landmarks[i].shared_covariance;
      out.nees += error.dot(whole.inverse() * error) / (2.0 * kLandmarks * kRuns);
      mean += error / kLandmarks;
      common += landmarks[i].shared_covariance / kLandmarks;
      own += landmarks[i].covariance / kLandmarks;
    }
    const Matrix2<double> of_mean = common + own / kLandmarks;
    out.common_nees += mean.dot(of_mean.inverse() * mean) / (2.0 * kRuns);
    out.own_sigma += std::sqrt(own.trace() / 2) / kRuns;
  }
  return out;
}

TEST(LandmarkFilter, WithPosesFromTheLandmarksThemselvesItDoesNotBecomeSurerThanItIs) {
  constexpr double kFiveSigmas =
      1 +
      5 * 0.129;  // chi-square of 2 x 60 degrees of freedom: the runs are independent, landmarks are not
  for (const int updates : {1, 10, 100}) {
    const Consistency honest = update_by_themselves(true, updates);
    EXPECT_LT(honest.nees, kFiveSigmas) << updates;
    EXPECT_LT(honest.common_nees, kFiveSigmas) << updates;
    // Nor is it so careful that it says nothing.
    EXPECT_GT(honest.nees, 0.25) << updates;
    EXPECT_GT(honest.common_nees, 0.25) << updates;
    std::printf("%d updates: nees %.2f, of the mean %.2f, own sigma %.4f px\n", updates,
                honest.nees, honest.common_nees, honest.own_sigma * 2500);
  }
  // What it is for: the paper's filter believes more of itself with each picture.
  const Consistency believing = update_by_themselves(false, 100);
  std::printf("without: nees %.2f, of the mean %.2f\n", believing.nees, believing.common_nees);
  EXPECT_GT(believing.nees, 2 * kFiveSigmas);
}

// The same look told four times, each time as a quarter of it, is that look.
TEST(LandmarkFilter, QuartersOfTheSameLookAreOneLook) {
  LandmarkSight sight;
  sight.cov_detection << 4e-8, 1e-8, 1e-8, 2e-8;
  sight.cov_of_pose = 5e-9 * Matrix2<double>::Identity();
  const Vector3<double> d = Vector3<double>(1, 0.2, -0.1).normalized();
  const Vector2<double> y(2e-4, -1e-4);
  const Vector3<double> seen_at = direction_plus<double>(d, y);
  const auto begin = [&] {
    LandmarkState out{d, Matrix2<double>::Zero(), Matrix2<double>::Zero()};
    out.covariance << 3e-8, -1e-8, -1e-8, 5e-8;
    return out;
  };
  LandmarkState whole = begin();
  sight.y = y;
  ASSERT_EQ(update_landmark(sight, Matrix2<double>::Zero(), 0, 1, 10, &whole), LandmarkUpdate::kOk);
  LandmarkState quarters = begin();
  for (int i = 0; i < 4; ++i) {
    sight.y = direction_minus(seen_at, quarters.d_b);
    ASSERT_EQ(update_landmark(sight, Matrix2<double>::Zero(), 0, 0.25, 10, &quarters),
              LandmarkUpdate::kOk);
  }
  // But for the sphere's curvature.
  EXPECT_LT((quarters.covariance - whole.covariance).norm(), 1e-4 * whole.covariance.norm());
  EXPECT_LT((quarters.d_b - whole.d_b).norm(), 1e-3 * (whole.d_b - d).norm());
  // As large a step as before is beyond the gate, however little of it is news.
  sight.y = Vector2<double>(4e-3, 0);
  EXPECT_EQ(update_landmark(sight, Matrix2<double>::Zero(), 0, 0.01, 10, &quarters),
            LandmarkUpdate::kBeyondGate);
}

// Where d_x passes d_y the basis turns by about 120 degrees. So coarse a sight hardly tells anything, but moves the landmark across.
TEST(LandmarkFilter, ItsCovariancesStayWhereTheBasisJumps) {
  const Vector3<double> across = Vector3<double>(1, -1, 0).normalized();
  LandmarkState state;
  state.d_b = (Vector3<double>(1, 1, 1.05).normalized() + 1e-8 * across).normalized();
  state.covariance << 4e-8, 1e-8, 1e-8, 1e-8;
  state.shared_covariance << 1e-8, 0, 0, 9e-8;
  const Matrix<double, 3, 2> before = tangent_basis(state.d_b);
  const Matrix3<double> own = before * state.covariance * before.transpose();
  const Matrix3<double> shared = before * state.shared_covariance * before.transpose();
  LandmarkSight sight;
  sight.cov_detection = 1e-2 * Matrix2<double>::Identity();
  sight.cov_of_pose.setZero();
  sight.y = -0.1 * before.transpose() * across;
  ASSERT_EQ(update_landmark(sight, Matrix2<double>::Zero(), 0, 1, 4, &state), LandmarkUpdate::kOk);
  const Matrix<double, 3, 2> after = tangent_basis(state.d_b);
  ASSERT_GT((after - before).norm(), 1);
  EXPECT_LT((after * state.covariance * after.transpose() - own).norm(), 1e-4 * own.norm());
  EXPECT_LT((after * state.shared_covariance * after.transpose() - shared).norm(),
            1e-4 * shared.norm());
}

}  // namespace
}  // namespace alidade::test

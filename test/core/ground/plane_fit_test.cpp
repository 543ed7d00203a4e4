#include "core/ground/plane_fit.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>

#include "core/ground/plane_solve.h"
#include "test/core/ground/plane_scene.h"

namespace alidade::test {
namespace {

constexpr int kRuns = 200;

// One way of fitting: what somebody tells.
struct FittingWay {
  const char* name;
  std::function<PlaneScene(std::uint64_t)> tell;
};

const std::vector<FittingWay>& fitting_ways() {
  static const std::vector<FittingWay> ways = {
      {"HeightAndLevel",
       [](std::uint64_t seed) {
         PlaneScene scene = PlaneScene::of_camera(seed);
         scene.add_height();
         scene.add_level();
         return scene;
       }},
      {"HeightLevelPlaceAndHeading",
       [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.add_height();
         scene.add_level();
         scene.add_place();
         scene.add_heading();
         return scene;
       }},
      {"PointsAndLevel",
       [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.add_level();
         scene.add_point({60, 10, 0});
         scene.add_point({80, 50, 0});
         scene.add_point({40, 30, 0});
         return scene;
       }},
      {"PointsAlone",
       [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.add_point({60, 10, 0});
         scene.add_point({90, 60, 0});
         scene.add_point({20, 30, 0});
         scene.add_point({50, -35, 0});
         scene.add_point({75, 20, 6});
         return scene;
       }},
      {"PointsInTwoPictures",
       [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.sight_sigma = 1e-4;
         const int left = scene.add_look({2e-3, 1e-3, 1e-3});
         const int right = scene.add_look({2e-3, 1e-3, 1e-3});
         scene.add_height();
         scene.add_point({60, 10, 0}, left);
         scene.add_point({64, 18, 0}, left);
         scene.add_point({55, 14, 3}, left);
         scene.add_point({20, 30, 0}, right);
         scene.add_point({24, 44, 0}, right);
         scene.add_point({30, 36, 0}, right);
         return scene;
       }},
      {"HorizonAndLength",
       [](std::uint64_t seed) {
         PlaneScene scene = PlaneScene::of_camera(seed);
         scene.add_horizon(-0.5);
         scene.add_horizon(0.1);
         scene.add_horizon(0.9);
         scene.add_length({5, 30}, {-6, 40});
         return scene;
       }},
      {"VanishingPointsAndLength",
       [](std::uint64_t seed) {
         PlaneScene scene = PlaneScene::of_camera(seed);
         scene.add_vertical();
         scene.add_horizon(0.3);
         scene.add_horizon(0.3 + kPi / 2);
         scene.add_length({5, 30}, {-6, 40});
         return scene;
       }},
      {"BearingHorizonAndHeight",
       [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.truth.position.head<2>().setZero();
         scene.add_bearing(0.4);
         scene.add_horizon(1.4);
         scene.add_height();
         return scene;
       }},
      {"UprightTargets",
       [](std::uint64_t seed) {
         PlaneScene scene = PlaneScene::of_camera(seed);
         scene.add_upright({0, 25});
         scene.add_upright({12, 20});
         scene.add_upright({-15, 30});
         scene.add_upright({20, 35}, 4, 0.03);
         scene.add_upright({-8, 15});
         scene.add_upright({3, 50}, 4, 0.03);
         return scene;
       }},
      {"AllTogether", [](std::uint64_t seed) {
         PlaneScene scene(seed);
         scene.add_height();
         scene.add_level();
         scene.add_place();
         scene.add_point({60, 10, 0});
         scene.add_point({80, 50, 2});
         scene.add_horizon(0.5);
         scene.add_upright({60, 0});
         scene.add_length({50, 0}, {60, 25});
         return scene;
       }}};
  return ways;
}

// e^T P^-1 e of what is unknown.
double normalised_error(const PlaneScene& scene, const PlaneFit& fit, int* unknowns) {
  const internal::PlaneProblem problem(scene.evidence);
  const auto N = internal::plane_unknowns(problem.frame, scene.truth);
  const Eigen::MatrixXd to_unknowns = (N.transpose() * N).inverse() * N.transpose();
  const Eigen::VectorXd error = to_unknowns * plane_minus(fit.plane, scene.truth);
  const Eigen::MatrixXd covariance = to_unknowns * fit.plane.covariance * to_unknowns.transpose();
  *unknowns = static_cast<int>(error.size());
  return error.dot(covariance.inverse() * error);
}

class PlaneFitWay : public testing::TestWithParam<FittingWay> {};

TEST_P(PlaneFitWay, SigmasAreWhatErrorsAre) {
  double sum = 0;
  int unknowns = 1;
  double misfit_sum = 0;
  int misfits = 0;
  int by_chance = 0;
  for (int run = 0; run < kRuns; ++run) {
    const PlaneScene scene = GetParam().tell(static_cast<std::uint64_t>(run + 1));
    const PlaneFit fit = fit_plane(scene.evidence);
    by_chance += fit.status == PlaneFitStatus::kMisfit ? 1 : 0;
    if (fit.status != PlaneFitStatus::kMisfit) {
      ASSERT_EQ(fit.status, PlaneFitStatus::kOk) << run << ": " << fit.message;
    }
    sum += normalised_error(scene, fit, &unknowns);
    for (const DatumFit& datum : fit.data) {
      if (!datum.misfit) continue;
      misfit_sum += *datum.misfit * *datum.misfit;
      ++misfits;
    }
  }
  // A misfit of 5 sigmas in two dimensions is one of 270,000; there are a thousand.
  EXPECT_LE(by_chance, 1);
  const double anees = sum / (kRuns * unknowns);
  RecordProperty("anees", std::to_string(anees));
  // Chi-square with as many degrees of freedom: in 95 % of all seeds the ten ways are all within 2.81 sigmas.
  EXPECT_NEAR(anees, 1, 2.81 * std::sqrt(2.0 / (kRuns * unknowns)));
  // Standardised residuals have unit variance; those of one run hang together, thus hardly more than two data a run count.
  if (misfits > 0) {
    EXPECT_NEAR(misfit_sum / misfits, 1, 4 * std::sqrt(2.0 / kRuns));
  }
}

INSTANTIATE_TEST_SUITE_P(Ways, PlaneFitWay, testing::ValuesIn(fitting_ways()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(PlaneFit, CovarianceIsThatOfDraws) {
  constexpr int kDraws = 4000;
  const auto tell = [](std::uint64_t seed) {
    PlaneScene scene(seed);
    scene.add_height();
    scene.add_level();
    scene.add_heading();
    scene.add_point({60, 10, 0});
    scene.add_point({40, 30, 3});
    return scene;
  };
  PlaneScene exact = tell(1);
  const PlaneFit fit = fit_plane(exact.evidence);
  ASSERT_EQ(fit.status, PlaneFitStatus::kOk) << fit.message;
  PlaneCovariance sum = PlaneCovariance::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const PlaneScene scene = tell(static_cast<std::uint64_t>(1000 + i));
    const PlaneFit drawn = fit_plane(scene.evidence);
    ASSERT_EQ(drawn.status, PlaneFitStatus::kOk) << drawn.message;
    const Matrix<double, 6, 1> error = plane_minus(drawn.plane, scene.truth);
    sum += error * error.transpose();
  }
  const PlaneCovariance whiten =
      fit.plane.covariance.llt().matrixL().solve(PlaneCovariance::Identity());
  const PlaneCovariance ratio = whiten * (sum / kDraws) * whiten.transpose();
  // Each entry of a sample's covariance has a sigma of sqrt(2 / n) or less, 21 entries; the covariance is that of one draw's plane,
  // which is some 1 % off in its lengths.
  EXPECT_LT((ratio - PlaneCovariance::Identity()).cwiseAbs().maxCoeff(),
            4 * std::sqrt(2.0 / kDraws) + 0.02)
      << ratio;
}

TEST(PlaneFit, NamesTheDatumThatIsGrosslyWrong) {
  int named = 0;
  for (int run = 0; run < 40; ++run) {
    PlaneScene scene(static_cast<std::uint64_t>(run + 1));
    scene.add_level();
    scene.add_point({60, 10, 0});
    scene.add_point({90, 60, 0});
    scene.add_point({20, 30, 0});
    scene.add_point({50, -35, 0});
    scene.add_point({75, 20, 6});
    scene.add_upright({60, 0});
    // A typing error of a metre in one point.
    const std::size_t wrong = 1 + static_cast<std::size_t>(run % 5);
    scene.evidence.data[wrong].place.x() += 1;
    const PlaneFit fit = fit_plane(scene.evidence);
    ASSERT_EQ(fit.status, PlaneFitStatus::kMisfit) << run;
    if (fit.worst == static_cast<int>(wrong)) ++named;
    EXPECT_NE(fit.message.find("does not fit"), std::string::npos);
  }
  EXPECT_EQ(named, 40);
}

TEST(PlaneFit, NamesAHeightThatIsGrosslyWrong) {
  PlaneScene scene(3);
  scene.add_height();
  scene.add_level();
  scene.add_point({60, 10, 0});
  scene.add_point({90, 60, 0});
  scene.add_point({20, 30, 0});
  scene.evidence.data[0].value = 15;
  const PlaneFit fit = fit_plane(scene.evidence);
  EXPECT_EQ(fit.status, PlaneFitStatus::kMisfit);
  EXPECT_EQ(fit.worst, 0) << fit.message;
}

TEST(PlaneFit, WhatNothingChecksHasNoMisfit) {
  PlaneScene scene = PlaneScene::of_camera(1);
  scene.add_height();
  scene.add_level();
  const PlaneFit fit = fit_plane(scene.evidence);
  ASSERT_EQ(fit.status, PlaneFitStatus::kOk);
  for (const DatumFit& datum : fit.data) EXPECT_FALSE(datum.misfit.has_value());
  EXPECT_EQ(fit.degrees_of_freedom, 0);
  EXPECT_TRUE(fit.origin_below_camera);
  EXPECT_TRUE(fit.heading_of_base);
  // What is defined has no error, but for what keeps the heading while the base tilts.
  EXPECT_TRUE(fit.plane.covariance.row(3).isZero(0));
  EXPECT_TRUE(fit.plane.covariance.row(4).isZero(0));
  const Vector3<double> J = heading_jacobian(fit.plane);
  EXPECT_LT((J.transpose() * fit.plane.covariance.topLeftCorner<3, 3>()).norm(), 1e-15);
}

// More than height and level alone, which are enough: what ties the camera to a place takes nothing away.
TEST(PlaneFit, WithOnePlaceOrPointTheHeadingIsTheBases) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const bool is_point : {true, false}) {
      PlaneScene scene = PlaneScene::of_camera(seed);
      scene.add_height();
      scene.add_level();
      const PlaneFit alone = fit_plane(scene.evidence);
      ASSERT_EQ(alone.status, PlaneFitStatus::kOk) << alone.message;
      const Vector2<double> moved(300, -70);
      scene.truth.position.head<2>() += moved;
      if (is_point) {
        scene.add_point({moved.x() + 5, moved.y() + 60, 0});
      } else {
        scene.add_place();
      }
      const PlaneFit fit = fit_plane(scene.evidence);
      ASSERT_EQ(fit.status, PlaneFitStatus::kOk) << fit.message;
      EXPECT_TRUE(fit.heading_of_base);
      EXPECT_FALSE(fit.origin_below_camera);
      EXPECT_EQ(fit.degrees_of_freedom, 0);
      const auto sigma = fit.plane.covariance.diagonal().cwiseSqrt().eval();
      for (int axis = 0; axis < 2; ++axis) {
        EXPECT_NEAR(fit.plane.position[axis], scene.truth.position[axis], 5 * sigma[3 + axis])
            << seed;
      }
      EXPECT_NEAR(fit.plane.height(), alone.plane.height(), 1e-6);
      EXPECT_NEAR(heading(fit.plane), 0, 1e-9);
    }
  }
}

TEST(PlaneFit, LargerResidualsThanStatedMakeLargerSigmas) {
  PlaneScene scene(5);
  scene.sight_sigma = 3e-3;
  for (int i = 0; i < 12; ++i) scene.add_point({40 + 5.0 * i, 10 + 17.0 * (i % 4), 0});
  for (PlaneDatum& datum : scene.evidence.data) datum.sight.covariance /= 4;
  const PlaneFit fit = fit_plane(scene.evidence);
  ASSERT_EQ(fit.status, PlaneFitStatus::kOk) << fit.message;
  EXPECT_NEAR(fit.noise_scale, 2, 0.6);
}

struct Refusal {
  const char* name;
  PlaneFitStatus status;
  const char* says;
  std::function<void(PlaneScene*)> tell;
};

class PlaneFitRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(PlaneFitRefusal, SaysWhyAndWhatWouldHelp) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(seed);
    GetParam().tell(&scene);
    const PlaneFit fit = fit_plane(scene.evidence);
    EXPECT_EQ(fit.status, GetParam().status) << to_string(fit.status) << " " << fit.message;
    EXPECT_NE(fit.message.find(GetParam().says), std::string::npos) << fit.message;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Each, PlaneFitRefusal,
    testing::Values(Refusal{"PointsInALine", PlaneFitStatus::kUndetermined, "lie on a line",
                            [](PlaneScene* scene) {
                              for (const double t : {0.0, 1.0, 2.0, 3.5})
                                scene->add_point({50 + 20 * t, -10 + 15 * t, 0});
                              // Surveyed as a line.
                              for (int i = 0; i < 4; ++i) {
                                PlaneDatum& datum =
                                    scene->evidence.data[static_cast<std::size_t>(i)];
                                const double t = (datum.place.x() - 50) / 20;
                                datum.place = Vector3<double>(50 + 20 * t, -10 + 15 * t, 0);
                              }
                            }},
                    Refusal{"CameraOnPlane", PlaneFitStatus::kCameraOnPlane, "edge-on",
                            [](PlaneScene* scene) {
                              scene->truth.position.z() = 0.001;
                              scene->add_level(1e-4);
                              scene->add_point({60, 10, 0});
                              scene->add_point({90, 60, 0});
                              scene->add_point({20, 30, 0});
                            }},
                    Refusal{"NoScale", PlaneFitStatus::kNoScale, "nothing gives the scale",
                            [](PlaneScene* scene) {
                              scene->add_level();
                              scene->add_horizon(0.5);
                            }},
                    Refusal{"NoTilt", PlaneFitStatus::kUndetermined, "tilt",
                            [](PlaneScene* scene) {
                              scene->add_height();
                              scene->add_horizon(0.5);
                            }},
                    Refusal{"NoNorthOfAPlace", PlaneFitStatus::kUndetermined, "heading",
                            [](PlaneScene* scene) {
                              scene->evidence.y_is_north = true;
                              scene->add_height();
                              scene->add_level();
                              scene->add_place();
                            }},
                    Refusal{"NoNorthOfAPoint", PlaneFitStatus::kUndetermined, "heading",
                            [](PlaneScene* scene) {
                              scene->evidence.y_is_north = true;
                              scene->add_height();
                              scene->add_level();
                              scene->add_point({60, 10, 0});
                            }},
                    Refusal{"HeightOnlyByALengthFarAway", PlaneFitStatus::kUndetermined, "height",
                            [](PlaneScene* scene) {
                              scene->sight_sigma = 3e-3;
                              scene->add_level(1e-3);
                              scene->add_length({130, 0}, {130, 1});
                            }},
                    Refusal{"BadSigma", PlaneFitStatus::kBadInput, "sigma",
                            [](PlaneScene* scene) {
                              scene->add_height();
                              scene->add_level();
                              scene->evidence.data[0].sigma = 0;
                            }},
                    Refusal{"NotFinite", PlaneFitStatus::kBadInput, "height",
                            [](PlaneScene* scene) {
                              scene->add_height();
                              scene->evidence.data[0].value =
                                  std::numeric_limits<double>::quiet_NaN();
                            }},
                    Refusal{"FootInTheSky", PlaneFitStatus::kNoSolution, "above the horizon",
                            [](PlaneScene* scene) {
                              scene->add_level(1e-3);
                              scene->add(upright("balloon", scene->seen_at(0.3, 0.4),
                                                 scene->seen_at(0.3, 0.5), 1.8, 0.02));
                            }}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(PlaneFit, ThreePointsAloneAreRefusedWhereTwoPlacesFit) {
  int refused = 0;
  int fitted = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    PlaneScene scene(seed);
    std::uniform_real_distribution<double> part(-1, 1);
    for (int i = 0; i < 3; ++i)
      scene.add_point({60 + 30 * part(scene.random), 20 + 40 * part(scene.random), 0});
    const PlaneFit fit = fit_plane(scene.evidence);
    if (fit.status == PlaneFitStatus::kOk) {
      ++fitted;
      int unknowns = 0;
      // What is not refused is right.
      EXPECT_LT(normalised_error(scene, fit, &unknowns), 40) << seed;
    } else {
      ++refused;
    }
  }
  RecordProperty("fitted", fitted);
  EXPECT_GT(refused, 0);
  EXPECT_GT(fitted, 0);
}

}  // namespace
}  // namespace alidade::test

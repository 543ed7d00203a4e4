#include "core/pattern/lens.h"

#include <gtest/gtest.h>

#include "core/model/lens/camera.h"
#include "test/support/not_a_number.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

LensVector lens_with(double k1, double k2, double p1, double p2) {
  LensVector lens;
  lens << 600, 610, 321, 238, k1, k2, p1, p2, 3e-5;
  return lens;
}

std::vector<Vector3<double>> points() {
  return {{0, 0, 1}, {0.3, -0.2, 1}, {-0.4, 0.35, 0.9}, {1e-9, 1e-9, 2}, {-1.2, 0.8, 3}};
}

TEST(Lens, DerivativesAreThoseOfTheProjection) {
  for (const LensVector& lens : {lens_with(0, 0, 0, 0), lens_with(-0.28, 0.08, 1e-3, -2e-3),
                                 lens_with(0.3, -0.05, -1e-3, 5e-4)}) {
    for (const Vector3<double>& p : points()) {
      Vector2<double> u;
      Matrix<double, 2, 3> J_p;
      Matrix<double, 2, kLensParameterCount> J_lens;
      ASSERT_EQ(project_lens(lens, p, &u, &J_p, &J_lens), ProjectionStatus::kOk);
      const auto by_point = test::numeric_jacobian<2, 3>(
          [&](const Vector3<double>& e) -> std::optional<Vector2<double>> {
            Vector2<double> out;
            if (project_lens(lens, p + e, &out) != ProjectionStatus::kOk) return std::nullopt;
            return out;
          },
          1e-4);
      EXPECT_LT(test::disagreement(J_p, by_point, 1e-12), 1) << p.transpose();
      LensVector steps = LensVector::Constant(1e-3);
      steps.head<4>().setConstant(0.1);
      const auto by_lens = test::numeric_jacobian<2, kLensParameterCount>(
          [&](const LensVector& e) -> std::optional<Vector2<double>> {
            Vector2<double> out;
            if (project_lens(lens + e, p, &out) != ProjectionStatus::kOk) return std::nullopt;
            return out;
          },
          steps);
      EXPECT_LT(test::disagreement(J_lens, by_lens, 1e-12), 1) << p.transpose();
    }
  }
}

// The camera that everything else of Alidade uses is a special case.
TEST(Lens, WithoutTangentialTermsIsTheCameraOfTheModel) {
  LensVector lens = lens_with(0.1, 0, 0, 0);
  lens[index(LensParameter::kCentreU)] = 320;
  lens[index(LensParameter::kCentreV)] = 240;
  const Camera<double> camera{600, 610.0 / 600, {0.1}, 640, 480};
  for (const Vector3<double>& p : points()) {
    Vector2<double> u;
    Vector2<double> of_camera;
    ASSERT_EQ(project_lens(lens, p, &u), ProjectionStatus::kOk);
    ASSERT_EQ(project(camera, p, &of_camera), ProjectionStatus::kOk);
    EXPECT_LT((u - of_camera).norm(), 1e-11);
  }
}

TEST(Lens, RefusesWhatItCannotSee) {
  Vector2<double> u;
  EXPECT_EQ(project_lens(lens_with(0, 0, 0, 0), {0, 0, 0}, &u), ProjectionStatus::kBehindCamera);
  EXPECT_EQ(project_lens(lens_with(0, 0, 0, 0), {0, 0, -1}, &u), ProjectionStatus::kBehindCamera);
  EXPECT_EQ(project_lens(lens_with(-0.3, 0, 0, 0), {1.1, 0, 1}, &u),
            ProjectionStatus::kBeyondDistortionLimit);
  EXPECT_EQ(project_lens(lens_with(0, 0, 0, 0), {kNan, 0, 1}, &u), ProjectionStatus::kNotFinite);
}

}  // namespace
}  // namespace alidade

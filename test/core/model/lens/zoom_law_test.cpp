#include "core/model/lens/zoom_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using Quantities = ZoomQuantities<double>;

// The parameters of a camera in the order of ZoomQuantity.
Quantities parameters_of(const Camera<double>& camera) {
  Calibration calibration;
  calibration.camera = camera;
  Quantities out;
  for (int i = 0; i < kZoomQuantityCount; ++i) {
    out[i] = parameter_value(calibration, kParameterOfQuantity[static_cast<std::size_t>(i)]);
  }
  return out;
}

TEST(ZoomLaw, DistortionInTheCornerStays) {
  for (const auto& [name, camera, margin] : test::hard_cameras()) {
    for (const double change : {-3.0, -1e-12, 0.0, 0.7}) {
      const Camera<double> there = zoomed(camera, change);
      EXPECT_NEAR(there.focal_length, camera.focal_length * std::exp(change),
                  1e-15 * there.focal_length);
      // k (R / f)^2, written out
      const double R = 0.5 * std::hypot(camera.width, camera.height);
      const double kappa = camera.distortion.radial * std::pow(R / camera.focal_length, 2);
      EXPECT_NEAR(there.distortion.radial * std::pow(R / there.focal_length, 2), kappa,
                  1e-14 * std::abs(kappa))
          << name;
      EXPECT_NEAR(corner_distortion(there)[0], kappa, 1e-14 * std::abs(kappa)) << name;
      EXPECT_EQ(there.centre_offset(), camera.centre_offset());
      EXPECT_EQ(there.aspect, camera.aspect);
    }
  }
}

// The picture of a zoomed lens is that of before, larger: seen from the directions d whose x is
// smaller by the same factor.
TEST(ZoomLaw, AZoomedLensShowsAnEnlargedPicture) {
  const Camera<double> camera{900, 1.02, {-0.2}, 640, 480, 5, -3};
  const Camera<double> there = zoomed(camera, std::log(2.5));
  Vector2<double> u, zoomed_u;
  ASSERT_EQ(project(camera, {0.3, -0.2, 1}, &u), ProjectionStatus::kOk);
  ASSERT_EQ(project(there, {0.3, -0.2, 2.5}, &zoomed_u), ProjectionStatus::kOk);
  EXPECT_LT((u - zoomed_u).norm(), 1e-11);
}

TEST(ZoomLaw, DerivativesAreThoseOfTheLaw) {
  for (const auto& [name, hard, margin] : test::hard_cameras()) {
    const Camera<double> camera = hard;
    const auto by_log_f = test::numeric_jacobian<kZoomQuantityCount, 1>(
        [&](const Matrix<double, 1, 1>& change) -> std::optional<Quantities> {
          return parameters_of(zoomed(camera, change[0]));
        },
        Matrix<double, 1, 1>(1e-3));
    const CameraColumn<double> along = by_zoom(camera);
    Quantities expected;
    for (int i = 0; i < kZoomQuantityCount; ++i) {
      expected[i] = along[index(kParameterOfQuantity[static_cast<std::size_t>(i)])];
    }
    EXPECT_LT(test::disagreement(Quantities(expected), by_log_f, 1e-11 * camera.focal_length), 1)
        << name;

    const Quantities y = zoom_quantities(camera);
    const auto by_quantities = test::numeric_jacobian<kZoomQuantityCount, kZoomQuantityCount>(
        [&](const Quantities& change) -> std::optional<Quantities> {
          Camera<double> there = camera;
          set_zoom_quantities(Quantities(y + change), &there);
          return parameters_of(there);
        },
        Quantities::Constant(1e-3));
    const ZoomQuantityMatrix<double> J = by_zoom_quantities(camera);
    EXPECT_LT(test::disagreement(J, by_quantities, 1e-11 * camera.focal_length), 1) << name;
    EXPECT_LT((zoom_quantities_by_camera(camera) * J - ZoomQuantityMatrix<double>::Identity())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9)
        << name;
  }
}

TEST(ZoomLaw, QuantitiesComeBack) {
  for (const auto& [name, camera, margin] : test::hard_cameras()) {
    Camera<double> back = camera;
    back.focal_length = 1;
    back.distortion = {};
    back.set_centre_offset({0, 0});
    set_zoom_quantities(zoom_quantities(camera), &back);
    EXPECT_NEAR(back.focal_length, camera.focal_length, 1e-13 * camera.focal_length) << name;
    EXPECT_NEAR(back.distortion.radial, camera.distortion.radial,
                1e-12 * std::abs(camera.distortion.radial))
        << name;
    EXPECT_EQ(back.centre_offset(), camera.centre_offset()) << name;
  }
}

// A Jacobian by the zoomed camera becomes one by the camera before.
TEST(ZoomLaw, JacobiansReferToTheCameraBefore) {
  const Camera<double> camera{900, 1.02, {-0.2}, 640, 480, 5, -3};
  constexpr double kChange = 0.4;
  const Vector3<double> d(0.2, 0.15, 1);
  const Camera<double> there = zoomed(camera, kChange);
  Vector2<double> u;
  Matrix<double, 2, kCameraParameterCount> J;
  ASSERT_EQ(project(there, d, &u, nullptr, &J), ProjectionStatus::kOk);
  const Vector2<double> along = by_zoom(there, J);
  refer_to_unzoomed(there.focal_length / camera.focal_length, &J);
  using Column = CameraColumn<double>;
  const auto numeric = test::numeric_jacobian<2, kCameraParameterCount>(
      [&](const Column& change) -> std::optional<Vector2<double>> {
        const Camera<double> changed{camera.focal_length + change[0],
                                     camera.aspect + change[1],
                                     {camera.distortion.radial + change[2]},
                                     camera.width,
                                     camera.height,
                                     camera.centre_u + change[3],
                                     camera.centre_v + change[4]};
        Vector2<double> out;
        if (project(zoomed(changed, kChange), d, &out) != ProjectionStatus::kOk) {
          return std::nullopt;
        }
        return out;
      },
      (Column() << 0.5, 1e-3, 1e-3, 0.1, 0.1).finished());
  EXPECT_LT(test::disagreement(J, numeric, 1e-10), 1);
  const auto by_change = test::numeric_jacobian<2, 1>(
      [&](const Matrix<double, 1, 1>& change) -> std::optional<Vector2<double>> {
        Vector2<double> out;
        if (project(zoomed(there, change[0]), d, &out) != ProjectionStatus::kOk) {
          return std::nullopt;
        }
        return out;
      },
      Matrix<double, 1, 1>(1e-3));
  EXPECT_LT(test::disagreement(Vector2<double>(along), by_change, 1e-10), 1);
}

TEST(ZoomLaw, NoDistortionStaysNone) {
  Camera<double> camera{900, 1, {0}, 640, 480};
  EXPECT_EQ(zoomed(camera, 2).distortion.radial, 0);
  EXPECT_EQ(corner_distortion(camera)[0], 0);
  set_corner_distortion(CornerDistortion<double>(0.1), &camera);
  EXPECT_NEAR(camera.distortion.radial, 0.1 * std::pow(900.0 / 400, 2), 1e-15);
}

}  // namespace
}  // namespace alidade

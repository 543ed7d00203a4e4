#include "core/mapping/lens_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

// From 1000 to 20000 px; delta, distortion and centre wander.
LensCurve wandering_lens() {
  LensCurve lens({1000, 1.01, {-0.03}, 1280, 720, 5, -3}, std::log(1000.0), std::log(20000.0), 0.5);
  for (int i = 0; i < lens.control_points(); ++i) {
    lens.control_point(i) += LensQuantities(0.03 * std::sin(i), 0.02 * std::cos(2 * i),
                                            4 * std::sin(1.3 * i), 2 * std::cos(i));
  }
  return lens;
}

TEST(LensCurve, IsTheCameraThatItWasMadeOf) {
  const Camera<double> camera{1234, 1.02, {-0.4}, 1280, 720, 5, -3};
  const Camera<double> out = LensCurve::of(camera).camera_at(std::log(1234.0));
  EXPECT_NEAR(out.focal_length, 1234, 1e-9);
  EXPECT_EQ(out.aspect, camera.aspect);
  EXPECT_NEAR(out.distortion.radial, -0.4, 1e-12);
  EXPECT_DOUBLE_EQ(out.centre_u, 5);
  EXPECT_DOUBLE_EQ(out.centre_v, -3);
  EXPECT_EQ(out.width, 1280);
  EXPECT_EQ(out.height, 720);
}

TEST(LensCurve, OffItsCurveItKeepsTheCornerOrKOrLiesBetween) {
  LensCurve lens = wandering_lens();
  const double s = std::log(3000.0);
  const Camera<double> on = lens.camera_at(s);
  const double eps = 0.01;
  for (const double hold : {0.0, 0.5, 1.0}) {
    lens.hold() = hold;
    const Camera<double> off = lens.camera_at(s, eps);
    EXPECT_NEAR(std::log(off.focal_length / on.focal_length), eps, 1e-12);
    EXPECT_NEAR(std::log(off.distortion.radial / on.distortion.radial), 2 * hold * eps, 1e-12);
    EXPECT_EQ(lens.camera_at(s).distortion.radial, on.distortion.radial) << hold;
  }
  // With the corner kept, its distortion in pixels is the same.
  const Camera<double> off = lens.camera_at(s, eps);
  EXPECT_NEAR(corner_distortion(off)[0], corner_distortion(on)[0], 1e-12);
}

TEST(LensCurve, TheLensOfAFocalLengthIsThatOfItsPosition) {
  const LensCurve lens = wandering_lens();
  for (double s = std::log(900.0); s < std::log(22000.0); s += 0.07) {
    const Camera<double> there = lens.camera_at(s);
    const Camera<double> found = lens.camera_of(std::log(there.focal_length));
    EXPECT_NEAR(found.focal_length / there.focal_length, 1, 1e-12);
    EXPECT_NEAR(found.distortion.radial, there.distortion.radial,
                1e-9 * (1 + std::abs(there.distortion.radial)));
    EXPECT_NEAR(found.centre_u, there.centre_u, 1e-9);
    EXPECT_NEAR(found.centre_v, there.centre_v, 1e-9);
  }
}

TEST(LensCurve, ItsSlopeIsTheNumericOne) {
  const LensCurve lens = wandering_lens();
  int evaluated = 0;
  for (double log_f = std::log(910.0); log_f < std::log(22000.0); log_f += 0.0731) {
    Matrix<double, kCameraParameterCount, 1> J;
    const Camera<double> at = lens.camera_of(log_f, &J);
    // Of f the logarithm, of k the corner's share: all of one size.
    const double per_corner = std::pow(at.focal_length / lens.corner_px(), 2);
    const NumericFunction<5, 1> f = [&](const Matrix<double, 1, 1>& change) {
      const Camera<double> c = lens.camera_of(log_f + change[0]);
      return std::optional<Matrix<double, 5, 1>>({c.focal_length / at.focal_length, c.aspect,
                                                  c.distortion.radial / per_corner, c.centre_u,
                                                  c.centre_v});
    };
    const auto numeric = numeric_jacobian<5, 1>(f, 1e-4);
    evaluated += numeric.evaluated;
    const Matrix<double, 5, 1> scaled(J[0] / at.focal_length, J[1], J[2] / per_corner, J[3], J[4]);
    EXPECT_LT((disagreement<5, 1>(scaled, numeric, 1e-11)), 1) << std::exp(log_f);
  }
  EXPECT_GT(evaluated, 160);
}

}  // namespace
}  // namespace alidade::test

#include "core/mapping/lens_prior.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support/zoom_by_formula.h"

namespace alidade::test {
namespace {

constexpr double kHeld = 2e-4;
constexpr double kCentre_px = 7;
constexpr LensPriorOptions kOptions{kHeld, kCentre_px, 0.4};

// Sigma of a quantity at a place, of control points whose errors are independent.
LensQuantities sigma_at(const LensPrior& prior, double log_f) {
  const LensCurve::Basis basis = prior.lens.basis_at(log_f);
  LensQuantities variance = LensQuantities::Zero();
  for (int i = 0; i < 4; ++i) {
    variance += basis.weight[i] * basis.weight[i] *
                prior.sigmas[static_cast<std::size_t>(basis.segment + i)].cwiseAbs2();
  }
  return variance.cwiseSqrt();
}

TEST(LensPrior, FollowsTheZoomCurveAndKnowsWhereThatKnowsLess) {
  const ZoomCurve curve = zoom_curve();
  const LensPrior prior = lens_prior(curve, 800, 2100, kOptions);
  ASSERT_EQ(prior.sigmas.size(), static_cast<std::size_t>(prior.lens.control_points()));
  for (const LensQuantities& sigma : prior.sigmas) {
    EXPECT_TRUE((sigma.array() > 0).all());
    EXPECT_NEAR(sigma[0], kHeld, 1e-12);
  }
  for (double reading = 800; reading <= 2100; reading += 37) {
    Calibration there;
    ASSERT_TRUE(curve.at(reading, &there));
    const Camera<double> camera = prior.lens.camera_at(std::log(there.camera.focal_length));
    EXPECT_NEAR(camera.focal_length / there.camera.focal_length, 1, 1e-6) << reading;
    const LensQuantities off = zoom_quantities(camera) - zoom_quantities(there.camera);
    EXPECT_LT(std::abs(off[index(ZoomQuantity::kCornerDistortion)]), 1e-4) << reading;
    EXPECT_LT(off.tail<2>().norm(), 0.05) << reading;
  }
  const auto at = [&](double reading) {
    Calibration there;
    EXPECT_TRUE(curve.at(reading, &there));
    return sigma_at(prior, std::log(there.camera.focal_length));
  };
  for (const int quantity : {index(ZoomQuantity::kCornerDistortion), index(ZoomQuantity::kCentreU),
                             index(ZoomQuantity::kCentreV)}) {
    EXPECT_GT(at(810)[quantity], 1.5 * at(1500)[quantity]) << "beyond the wide end: " << quantity;
  }
}

TEST(LensPrior, OfReadingsThatFallIsTheSame) {
  const ZoomCurve curve = zoom_curve();
  const LensPrior rising = lens_prior(curve, 1000, 2000, kOptions);
  const LensPrior falling = lens_prior(curve, 2000, 1000, kOptions);
  for (int i = 0; i < rising.lens.control_points(); ++i) {
    EXPECT_LT((rising.lens.control_point(i) - falling.lens.control_point(i)).norm(), 1e-6);
  }
}

TEST(LensPrior, OfALensThatDoesNotZoomIsItsCalibration) {
  const Calibration calibration = zoom_calibration(1500);
  const LensPrior prior = lens_prior(calibration, kOptions);
  const double log_f = std::log(calibration.camera.focal_length);
  const Camera<double> camera = prior.lens.camera_at(log_f);
  EXPECT_NEAR(camera.focal_length, calibration.camera.focal_length, 1e-9);
  EXPECT_NEAR(camera.centre_offset().x(), calibration.camera.centre_offset().x(), 1e-9);
  for (const LensQuantities& sigma : prior.sigmas) {
    EXPECT_NEAR(sigma[index(ZoomQuantity::kCentreU)], 0.5, 1e-9);
    EXPECT_NEAR(sigma[0], kHeld, 1e-12);
  }
  Calibration exact = calibration;
  exact.covariance.setZero();
  for (const LensQuantities& sigma : lens_prior(exact, kOptions).sigmas) {
    EXPECT_TRUE((sigma.array() > 0).all()) << "a prior needs a sigma";
    EXPECT_NEAR(sigma[index(ZoomQuantity::kCentreU)], kCentre_px, 1e-9) << "it was held, not known";
  }
}

}  // namespace
}  // namespace alidade::test

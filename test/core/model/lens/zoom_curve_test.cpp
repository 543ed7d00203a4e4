#include "core/model/lens/zoom_curve.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

namespace alidade {
namespace {

constexpr std::array<Parameter, kZoomQuantityCount> kLens = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kCentreU,
    Parameter::kCentreV};

// Three nodes whose values are as certain as a random covariance says, by a lens that comes back exactly.
ZoomCurve::Content three_nodes() {
  ZoomCurve::Content content;
  content.nodes = 3;
  content.reading = {100, 400, 1000};
  content.level = {8, -0.02, 1, -2};
  content.shared.camera.width = 1280;
  content.shared.camera.height = 720;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const int size = kZoomQuantityCount * content.nodes + kSharedCount;
  content.value.resize(kZoomQuantityCount * content.nodes, 1);
  for (int i = 0; i < content.value.rows(); ++i) content.value(i, 0) = 0.3 * normal(random);
  Eigen::MatrixXd root(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) root(i, j) = 1e-3 * normal(random);
  }
  content.covariance = root * root.transpose();
  for (std::size_t q = 0; q < kZoomQuantityCount; ++q) {
    content.smoothness[q] = {1, 0.5, 0.2};
    Eigen::Matrix3d kernel;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const auto x = [&](int node) {
          return (content.reading[static_cast<std::size_t>(node)] - 100) / 900;
        };
        kernel(i, j) = content.smoothness[q].covariance(x(i), x(j));
      }
    }
    content.inverse[q] = kernel.inverse();
  }
  return content;
}

double lens_value(const Calibration& calibration, int quantity) {
  const Camera<double>& camera = calibration.camera;
  switch (static_cast<ZoomQuantity>(quantity)) {
    case ZoomQuantity::kLogFocalLength:
      return camera.focal_length;
    case ZoomQuantity::kCornerDistortion:
      return camera.distortion.radial;
    case ZoomQuantity::kCentreU:
      return camera.centre_offset().x();
    default:
      return camera.centre_offset().y();
  }
}

// What a node's covariance says of f, k and c is that of its quantities by the numeric derivatives, and so is how it goes
// with what all zooms share.
TEST(ZoomCurve, TurnsItsQuantitiesCovarianceIntoThatOfTheLens) {
  constexpr double kStep = 1e-6;
  const ZoomCurve::Content content = three_nodes();
  for (int node = 0; node < content.nodes; ++node) {
    SCOPED_TRACE(node);
    const int first = kZoomQuantityCount * node;
    Matrix4<double> J;
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      ZoomCurve::Content more = content;
      ZoomCurve::Content less = content;
      more.value(first + j, 0) += kStep;
      less.value(first + j, 0) -= kStep;
      for (int i = 0; i < kZoomQuantityCount; ++i) {
        J(i, j) = (lens_value(ZoomCurve(more).node(node), i) -
                   lens_value(ZoomCurve(less).node(node), i)) /
                  (2 * kStep);
      }
    }
    const Eigen::MatrixXd all = content.covariance;
    const Matrix4<double> expected = J * all.block<4, 4>(first, first) * J.transpose();
    const Eigen::Matrix<double, 4, kSharedCount> with_shared =
        J * all.block<4, kSharedCount>(first, kZoomQuantityCount * content.nodes);
    const Calibration calibration = ZoomCurve(content).node(node);
    for (int i = 0; i < kZoomQuantityCount; ++i) {
      const int a = index(kLens[static_cast<std::size_t>(i)]);
      const double sigma = std::sqrt(expected(i, i));
      for (int j = 0; j < kZoomQuantityCount; ++j) {
        EXPECT_NEAR(calibration.covariance(a, index(kLens[static_cast<std::size_t>(j)])),
                    expected(i, j), 1e-6 * sigma * std::sqrt(expected(j, j)));
      }
      for (int j = 0; j < kSharedCount; ++j) {
        const int b = index(kSharedParameters[static_cast<std::size_t>(j)]);
        EXPECT_NEAR(calibration.covariance(a, b), with_shared(i, j), 1e-6 * sigma);
        EXPECT_EQ(calibration.covariance(a, b), calibration.covariance(b, a));
      }
    }
  }
}

TEST(ZoomCurve, GoesThroughItsNodesAndIsLessCertainBetweenAndBeyond) {
  ZoomCurve::Content content = three_nodes();
  const ZoomCurve curve(content);
  for (int node = 0; node < content.nodes; ++node) {
    Calibration there;
    ASSERT_TRUE(curve.at(content.reading[static_cast<std::size_t>(node)], &there));
    for (int i = 0; i < kZoomQuantityCount; ++i) {
      const double value = lens_value(curve.node(node), i);
      EXPECT_NEAR(lens_value(there, i), value, 1e-9 * std::abs(value));
    }
    const int f = index(Parameter::kFocalLength);
    EXPECT_NEAR(there.covariance(f, f) / curve.node(node).covariance(f, f), 1, 1e-6);
  }
  content.covariance.setZero();
  const ZoomCurve exact(content);
  const auto relative_sigma = [&](double reading) {
    Calibration there;
    EXPECT_TRUE(exact.at(reading, &there));
    const int f = index(Parameter::kFocalLength);
    return std::sqrt(there.covariance(f, f)) / there.camera.focal_length;
  };
  EXPECT_LT(relative_sigma(100), 1e-6);
  EXPECT_LT(relative_sigma(200), relative_sigma(250));
  EXPECT_LT(relative_sigma(250), relative_sigma(700));  // the wider gap
  EXPECT_LT(relative_sigma(1000), relative_sigma(1100));
  EXPECT_LT(relative_sigma(1100), relative_sigma(1400));
}

TEST(ZoomCurve, AMovementAddsWhatTheLensDoesNotRepeat) {
  ZoomCurve::Content content = three_nodes();
  content.covariance.setZero();
  content.repeatability = 0.002;
  Calibration there;
  ASSERT_TRUE(ZoomCurve(content).at(400, &there));
  const int f = index(Parameter::kFocalLength);
  EXPECT_NEAR(std::sqrt(there.covariance(f, f)) / there.camera.focal_length, 0.002, 1e-8);
}

TEST(ZoomCurve, SaysNothingOfReadingsFarBeyondItsNodes) {
  const ZoomCurve curve(three_nodes());
  Calibration there;
  there.camera.focal_length = 5;
  EXPECT_FALSE(ZoomCurve().at(100, &there));
  for (const double reading : {-801.0, 1901.0, std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(curve.at(reading, &there)) << reading;
  }
  EXPECT_EQ(there.camera.focal_length, 5);
  EXPECT_TRUE(curve.at(-800, &there));
  EXPECT_TRUE(curve.at(1900, &there));
  EXPECT_EQ(there.zoom, 1900);
}

}  // namespace
}  // namespace alidade

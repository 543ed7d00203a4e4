#include "test/accuracy/zoom_comparison.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <vector>

namespace alidade::test {
namespace {

constexpr double kFocalLengthA = 1300;  // px
constexpr double kFocalLengthB = 4100;

const std::vector<Vector2<double>> kPoints = {{-300, -200}, {310, -190}, {-20, 10}, {290, 205}};

Matrix3<double> pinhole(double focal_length) {
  return Vector3<double>(focal_length, focal_length, 1).asDiagonal();
}

Matrix3<double> turn() {
  return (Eigen::AngleAxisd(0.11, Vector3<double>::UnitY()) *
          Eigen::AngleAxisd(-0.07, Vector3<double>::UnitX()) *
          Eigen::AngleAxisd(0.02, Vector3<double>::UnitZ()))
      .toRotationMatrix();
}

Matrix3<double> homography() {
  return pinhole(kFocalLengthB) * turn() * pinhole(1 / kFocalLengthA);
}

TEST(TurnAndZoom, FindsFocalLengthAndRotationOfAHomographyWithAnyFactor) {
  for (const double factor : {1.0, 2e-4, -3.0}) {
    const auto found = turn_and_zoom(factor * homography(), kFocalLengthA, kPoints);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->focal_length_b, kFocalLengthB, 1e-9 * kFocalLengthB);
    EXPECT_LT((found->R_b_from_a - turn()).norm(), 1e-12);
  }
}

// What no turn and zoom makes, as a rolling shutter does, is spread over the points, and not weighed by entries of H.
TEST(TurnAndZoom, FitsAnInexactHomographyWhereItIsKnown) {
  Matrix3<double> bent = homography() / homography()(2, 2);
  bent(2, 0) += 1e-6;
  const auto found = turn_and_zoom(bent, kFocalLengthA, kPoints);
  ASSERT_TRUE(found.has_value());
  const auto square = [](const TurnAndZoom& turn, const Matrix3<double>& H) {
    double sum = 0;
    for (const Vector2<double>& point : kPoints) {
      const Matrix3<double> of_it =
          pinhole(turn.focal_length_b) * turn.R_b_from_a * pinhole(1 / kFocalLengthA);
      sum += ((of_it * point.homogeneous()).hnormalized() - (H * point.homogeneous()).hnormalized())
                 .squaredNorm();
    }
    return sum;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double angle : {-1e-5, 1e-5}) {
      TurnAndZoom other = *found;
      other.R_b_from_a = Eigen::AngleAxisd(angle, Vector3<double>::Unit(axis)) * other.R_b_from_a;
      EXPECT_GT(square(other, bent), square(*found, bent));
    }
  }
  for (const double factor : {1 - 1e-5, 1 + 1e-5}) {
    TurnAndZoom other = *found;
    other.focal_length_b *= factor;
    EXPECT_GT(square(other, bent), square(*found, bent));
  }
}

TEST(TurnAndZoom, RefusesWhatIsNoHomography) {
  EXPECT_FALSE(turn_and_zoom(Matrix3<double>::Zero(), kFocalLengthA, kPoints).has_value());
  EXPECT_FALSE(
      turn_and_zoom(std::numeric_limits<double>::quiet_NaN() * homography(), kFocalLengthA, kPoints)
          .has_value());
}

}  // namespace
}  // namespace alidade::test

#include "core/pattern/circle_images.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <vector>

#include "test/core/pattern/pattern_simulation.h"

namespace alidade {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A plane's circle becomes a conic: H^-T C H^-1, whose centre and area are known in closed form.
TEST(CircleImage, LiesWhereTheConicDoes) {
  for (const double tilt : {0.0, 0.3, -0.7, 1.1}) {
    Matrix3d H = Eigen::AngleAxisd(tilt, Vector3d(1, 0.4, 0.1).normalized()).toRotationMatrix();
    H.col(2) += Vector3d(0.05, -0.1, 0.9);
    const double side = tilt < 0 ? -1 : 1;  // seen in a mirror the corners go round the other way
    H = Vector3d(600, side * 602, 1).asDiagonal() * H;
    for (const double radius : {1e-3, 0.02, 0.1}) {
      const Vector2d centre(0.1, -0.05);
      const auto map = [&](const Vector2d& place) -> Vector2d {
        return (H * place.homogeneous()).hnormalized();
      };
      Matrix3d C;
      C << 1, 0, -centre.x(), 0, 1, -centre.y(), -centre.x(), -centre.y(),
          centre.squaredNorm() - radius * radius;
      const Matrix3d Q = H.inverse().transpose() * C * H.inverse();
      const Eigen::Matrix2d A = Q.topLeftCorner<2, 2>();
      const Vector2d middle = -A.inverse() * Q.topRightCorner<2, 1>();
      const double area = M_PI * std::abs(Q.determinant() / std::pow(A.determinant(), 1.5));

      const internal::CircleImage image = internal::circle_image(map, centre, radius);
      const Vector2d expected = middle - map(centre);
      EXPECT_LT((image.beside - expected).norm(), 0.02 * expected.norm() + 1e-9)
          << tilt << ", " << radius;
      EXPECT_NEAR(image.area, area, 0.01 * area) << tilt << ", " << radius;
    }
  }
}

// Centroids of discs whose grid is full of points, through a lens that bends: their centres come back.
TEST(Recentred, CirclesAreWhereTheirCentresAreSeen) {
  const test::SimulatedLens lens;
  constexpr double kRadius_m = 0.009;
  PatternData data;
  data.width = 752;
  data.height = 480;
  for (int i = 0; i < 12; ++i) data.points_m.emplace_back(0.05 * (i % 4), 0.05 * (i / 4), 0);
  PoseCurve curve(std::vector<double>{0, 1});
  const Matrix3d R_pattern_from_camera =
      Eigen::AngleAxisd(0.5, Vector3d(0.6, -0.8, 0)).toRotationMatrix();
  const Vector3d camera(0.0, 0.05, -0.35);
  curve.R_0 = R_pattern_from_camera;
  for (int i = 0; i < curve.control_points(); ++i)
    curve.control_point(i) << camera, Vector3d::Zero();
  const auto seen = [&](const Vector3d& p) -> Vector2d {
    return test::simulated_pixel(lens, R_pattern_from_camera.transpose() * (p - camera));
  };
  data.frames.emplace_back();
  data.frames[0].time_s = 0.2;
  double most = 0;
  for (int i = 0; i < 12; ++i) {
    const Vector3d& centre = data.points_m[static_cast<std::size_t>(i)];
    Vector2d sum = Vector2d::Zero();
    double weights = 0;
    constexpr int kSteps = 200;
    const double h = kRadius_m / kSteps;
    for (int a = -kSteps; a <= kSteps; ++a) {
      for (int b = -kSteps; b <= kSteps; ++b) {
        if (a * a + b * b > kSteps * kSteps) continue;
        const Vector3d p = centre + Vector3d(a * h, b * h, 0);
        const Vector2d u = seen(p);
        const Vector2d along_x = seen(p + Vector3d(h, 0, 0)) - u;
        const Vector2d along_y = seen(p + Vector3d(0, h, 0)) - u;
        const double area = std::abs(along_x.x() * along_y.y() - along_x.y() * along_y.x());
        sum += area * u;
        weights += area;
      }
    }
    PatternObservation observation{i, sum / weights};
    observation.radius_m = kRadius_m;
    data.frames[0].observations.push_back(observation);
    most = std::max(most, (observation.u - seen(centre)).norm());
  }
  EXPECT_GT(most, 0.1);  // or there is nothing to mend
  const PatternData mended = recentred(data, test::truth_of(lens), curve);
  const PatternData twice = recentred(mended, test::truth_of(lens), curve);
  for (const PatternObservation& o : mended.frames[0].observations) {
    const auto i = static_cast<std::size_t>(o.point);
    EXPECT_LT((o.u - seen(data.points_m[i])).norm(), 0.01 * most);
    EXPECT_LT((o.u - twice.frames[0].observations[i].u).norm(), 1e-9);
  }
}

TEST(Recentred, PointsStayWhereTheyAre) {
  PatternData data;
  data.points_m = {{0, 0, 0}};
  data.frames.resize(1);
  data.frames[0].observations = {{0, {3, 4}}};
  const PatternData same = recentred(data, LensVector::Ones(), PoseCurve({0, 1}));
  EXPECT_EQ(same.frames[0].observations[0].u, Vector2d(3, 4));
}

}  // namespace
}  // namespace alidade

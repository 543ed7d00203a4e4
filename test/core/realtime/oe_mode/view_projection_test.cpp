// The cheap projection of a frame against the exact one, over cameras, line delays and motions.

#include "core/realtime/oe_mode/view_projection.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

constexpr double kRowTolerance = 1e-4;  // px, of ViewProjection's row

double norm_of(const Matrix<double, 2, 3>& J) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix2<double>>()
                       .computeDirect(J * J.transpose(), Eigen::EigenvaluesOnly)
                       .eigenvalues()[1]);
}

struct View {
  Calibration calibration;
  FrameMotion<double> motion;

  [[nodiscard]] double middle_row() const { return 0.5 * calibration.camera.height; }
  [[nodiscard]] double parameter(double row) const { return row / middle_row() - 1; }

  [[nodiscard]] ProjectionStatus exact(const Vector3<double>& d, Vector2<double>* u,
                                       Matrix<double, 2, 3>* J_u_d = nullptr,
                                       Sensitivity<2>* J_u_parameters = nullptr) const {
    return rolling_shutter_project(calibration.camera, calibration.mechanics,
                                   calibration.line_delay, motion, d, u, J_u_d, nullptr,
                                   J_u_parameters);
  }

  [[nodiscard]] Vector2<double> per_row(const Vector3<double>& d, double row) const {
    Vector2<double> u;
    Vector2<double> J_u_row;
    EXPECT_EQ(project_at_row(calibration.camera, calibration.mechanics, calibration.line_delay,
                             motion, row, d, &u, &J_u_row),
              ProjectionStatus::kOk);
    return J_u_row;
  }

  // Of R in half read-outs: for turns p and q about two axes, |(A B)'''| is at most
  // (p' + q')^3 + 3 (p' + q') (p'' + q''), by Leibniz. Rates are extreme at one of the ends.
  [[nodiscard]] double third_derivative(double row) const {
    const double half_s = std::abs(calibration.line_delay) * middle_row();
    double rate = 0;
    for (const double end : {0.0, 2 * middle_row(), row}) {
      const PanTilt<double> r = rate_at_row(motion, calibration.line_delay, end);
      rate = std::max(rate, half_s * (std::abs(r.pan) + std::abs(r.tilt)));
    }
    const double acceleration =
        half_s * half_s * (std::abs(motion.acceleration.pan) + std::abs(motion.acceleration.tilt));
    return rate * rate * rate + 3 * rate * acceleration;
  }

  // rad: a quadratic through s = -1, 0, 1 misses by s (s^2 - 1) / 6 of the third derivative, of
  // which 1 / 15.6 is the most between -1 and 1. Rounding besides.
  [[nodiscard]] double turn_left_out(double row) const {
    const double s = parameter(row);
    return std::abs(s * (s * s - 1)) / 6 * third_derivative(row) + 1e-15;
  }

  // px, to first order in both.
  [[nodiscard]] double position_bound(const Vector3<double>& d, double row,
                                      const Matrix<double, 2, 3>& J_u_d) const {
    const Vector2<double> J_u_row = per_row(d, row);
    return 1.01 * (norm_of(J_u_d) * turn_left_out(row) +
                   J_u_row.norm() * kRowTolerance / (1 - J_u_row.y())) +
           1e-8;
  }
};

struct Point {
  Vector2<double> u;
  Vector3<double> d;  // as seen there
  bool inside;
};

std::vector<Point> points_of(const View& view, const NamedCamera& named) {
  std::vector<Point> points;
  for (const Vector2<double>& u : pixel_grid(named, 9)) {
    Vector3<double> d;
    if (rolling_shutter_unproject(view.calibration.camera, view.calibration.mechanics,
                                  view.calibration.line_delay, view.motion, u,
                                  &d) != ProjectionStatus::kOk) {
      continue;
    }
    // A row that a direction crosses twice is none.
    Vector2<double> again;
    if (view.exact(d, &again) != ProjectionStatus::kOk || !((again - u).norm() < 1e-6)) continue;
    points.push_back(
        {u, d,
         u.x() >= 0 && u.y() >= 0 && u.x() <= named.camera.width && u.y() <= named.camera.height});
  }
  return points;
}

template <class Visit>
void for_all_views(Visit&& visit) {
  for (const NamedCamera& named : hard_cameras()) {
    for (const Mechanics<double>& mechanics : hard_mechanics()) {
      for (const double line_delay : hard_line_delays()) {
        for (const FrameMotion<double>& motion : hard_motions()) {
          View view;
          view.calibration.camera = named.camera;
          view.calibration.mechanics = mechanics;
          view.calibration.line_delay = line_delay;
          view.motion = motion;
          SCOPED_TRACE(testing::Message() << named.name << ", line delay " << line_delay
                                          << ", rate " << motion.rate.vector().transpose());
          visit(view, named);
        }
      }
    }
  }
}

TEST(ViewProjection, LeavesOutNoMoreThanTheThirdPowerOfTheTurn) {
  int compared = 0;
  int outside = 0;
  for_all_views([&](const View& view, const NamedCamera& named) {
    const ViewProjection projection(view.calibration, view.motion);
    for (const Point& point : points_of(view, named)) {
      Matrix<double, 2, 3> J_u_d;
      Vector2<double> exact;
      ASSERT_EQ(view.exact(point.d, &exact, &J_u_d), ProjectionStatus::kOk);
      Vector2<double> u;
      const bool seen = projection.project(point.d, &u);
      ASSERT_TRUE(seen || !point.inside) << point.u.transpose();
      if (!seen) continue;
      ++compared;
      outside += point.inside ? 0 : 1;
      const double bound = view.position_bound(point.d, exact.y(), J_u_d);
      ASSERT_LE((u - exact).norm(), bound) << point.u.transpose();

      SeenDirection all;
      ASSERT_TRUE(projection.project(point.d, &all));
      EXPECT_EQ(all.u, u);
      const double exact_time = time_of_row(view.motion, view.calibration.line_delay, exact.y());
      ASSERT_LE(std::abs(all.time_s - exact_time), std::abs(view.calibration.line_delay) * bound);
    }
  });
  EXPECT_GT(compared, 8 * 3 * 4 * 6 * 20);
  EXPECT_GT(outside, 8 * 3 * 4 * 6 * 5);
}

// The header's example.
TEST(ViewProjection, IsOffByLessThanAThousandthOfAPixelAtAFieldOfViewASecond) {
  View view;
  view.calibration.camera = {1663, 1, {0}, 1920, 1080};
  view.calibration.line_delay = 25e-6;
  view.motion = {{0, 0}, {kPi / 3, 0}, 540};
  const ViewProjection projection(view.calibration, view.motion);
  double worst = 0;
  for (const Point& point : points_of(view, {"", view.calibration.camera, 0})) {
    Vector2<double> u;
    ASSERT_TRUE(projection.project(point.d, &u));
    worst = std::max(worst, (u - point.u).norm());
  }
  EXPECT_LT(worst, 1e-3);
  EXPECT_GT(worst, 0);
}

// What J_angle takes from the middle row turns with tilt until the row is there; all else is off by what
// the positions are, and the row's share in it by the quadratic's slope, (3 s^2 - 1) / 6 of the third
// derivative.
TEST(ViewProjection, JacobiansAreThoseOfTheExactProjection) {
  int compared = 0;
  for_all_views([&](const View& view, const NamedCamera& named) {
    const ViewProjection projection(view.calibration, view.motion);
    const double delay = view.calibration.line_delay;
    struct ByParameters {
      double relative;
      Sensitivity<2> seen, exact;
    };
    std::vector<ByParameters> errors;
    double largest_stretch = 0;
    for (const Point& point : points_of(view, {named.name, named.camera, 0})) {
      SeenDirection seen;
      Sensitivity<2> seen_parameters;
      ASSERT_TRUE(projection.project(point.d, &seen, &seen_parameters));
      Matrix<double, 2, 3> J_u_d;
      Vector2<double> exact;
      Sensitivity<2> exact_parameters;
      ASSERT_EQ(view.exact(point.d, &exact, &J_u_d, &exact_parameters), ProjectionStatus::kOk);
      const double f = named.camera.focal_length;
      const double noise = 1e-13 * (f + named.camera.width);
      const double step = 1e-3 / std::sqrt(f);

      const auto numeric_angle = numeric_jacobian<2, 2>(
          [&](const Vector2<double>& change) -> std::optional<Vector2<double>> {
            View moved = view;
            moved.motion.angle = {view.motion.angle.pan + change.x(),
                                  view.motion.angle.tilt + change.y()};
            Vector2<double> u;
            if (moved.exact(point.d, &u) != ProjectionStatus::kOk) return std::nullopt;
            return u;
          },
          step);
      const auto numeric_d = numeric_jacobian<2, 2>(
          [&](const Vector2<double>& change) -> std::optional<Vector2<double>> {
            Vector2<double> u;
            if (view.exact(direction_plus<double>(point.d, change), &u) != ProjectionStatus::kOk) {
              return std::nullopt;
            }
            return u;
          },
          step);
      ASSERT_EQ(numeric_angle.evaluated, 8);
      ASSERT_EQ(numeric_d.evaluated, 8);

      const double s = view.parameter(exact.y());
      const double slope_left_out = (3 * s * s + 1) / 6 * view.third_derivative(exact.y());
      const double stretch = norm_of(J_u_d);
      // A pixel's stretch changes by less than ten times itself per focal length moved.
      const double by_row = stretch * slope_left_out / view.middle_row();
      const double by_position = 10 / f * view.position_bound(point.d, exact.y(), J_u_d);
      const double relative = view.turn_left_out(exact.y()) + by_row + by_position + 1e-6;
      const double tilted = std::abs(angle_at_row(view.motion, delay, exact.y()).tilt -
                                     angle_at_row(view.motion, delay, view.middle_row()).tilt);
      const double rounding = 1.5 * noise / step;
      EXPECT_LE((seen.J_d * tangent_basis(point.d) - numeric_d.J).norm(),
                1.5 * stretch * relative + rounding);
      EXPECT_LE((seen.J_angle - numeric_angle.J).norm(),
                1.5 * stretch * (relative + tilted) + rounding);
      const Vector2<double> turned = minus(angle_at_row(view.motion, delay, exact.y()),
                                           angle_at_row(view.motion, delay, view.middle_row()));
      largest_stretch = std::max(largest_stretch, stretch);
      errors.push_back({relative + turned.lpNorm<1>(), seen_parameters, exact_parameters});
      ++compared;
    }
    // Of what the parameter does anywhere in the image, as it may do nothing where the point is; an
    // axis' effect changes with the angles as a whole turn about it would.
    const int first_axis = index(Parameter::kPanAxis0);
    for (int i = 0; i < kParameterCount; ++i) {
      double most = i >= first_axis && i < first_axis + 4 ? largest_stretch : 1e-9;
      for (const auto& e : errors) most = std::max(most, e.exact.col(i).norm());
      for (const auto& e : errors) {
        ASSERT_LE((e.seen.col(i) - e.exact.col(i)).norm(), 3 * most * e.relative)
            << to_string(static_cast<Parameter>(i));
      }
    }
  });
  EXPECT_GT(compared, 8 * 3 * 4 * 6 * 20);
}

// At the row of the first guess, that is missed by what the image moves from the middle row to the
// true one, the slope's share of the way; the pixel by what it moves meanwhile.
TEST(ViewProjection, RoughlyMissesByTheSquareOfTheImagesMotion) {
  int compared = 0;
  for_all_views([&](const View& view, const NamedCamera& named) {
    const ViewProjection projection(view.calibration, view.motion);
    for (const Point& point : points_of(view, {named.name, named.camera, 0})) {
      Vector2<double> u;
      ASSERT_TRUE(projection.project_roughly(point.d, &u));
      const double way = point.u.y() - view.middle_row();
      double slope = 0;
      double moved = 0;
      // The first guess lies up to the slope's share beyond either end.
      for (double part = -1; part <= 2; part += 0.125) {
        const Vector2<double> J_u_row = view.per_row(point.d, view.middle_row() + part * way);
        slope = std::max(slope, std::abs(J_u_row.y()));
        moved = std::max(moved, J_u_row.norm());
      }
      ASSERT_LT(slope, 1);
      Matrix<double, 2, 3> J_u_d;
      Vector2<double> exact;
      ASSERT_EQ(view.exact(point.d, &exact, &J_u_d), ProjectionStatus::kOk);
      // s goes up to 1.5 here.
      const double left_out =
          1.5 * (1.5 * 1.5 - 1) / 6 * view.third_derivative(1.25 * named.camera.height);
      EXPECT_LE((u - exact).norm(),
                1.05 * moved * slope * std::abs(way) + 1.5 * norm_of(J_u_d) * left_out + 1e-8)
          << point.u.transpose();
      ++compared;
    }
  });
  EXPECT_GT(compared, 8 * 3 * 4 * 6 * 20);
}

TEST(ViewProjection, RoughlyIsWithinAPixelAtHalfAFieldOfViewASecond) {
  for (const NamedCamera& named : hard_cameras()) {
    for (const double line_delay : hard_line_delays()) {
      View view;
      view.calibration.camera = named.camera;
      view.calibration.line_delay = line_delay;
      const double f = named.camera.focal_length;
      view.motion = {
          {0.3, 0.1},
          {std::atan(0.5 * named.camera.width / f), std::atan(0.5 * named.camera.height / f)},
          0.5 * named.camera.height};
      const ViewProjection projection(view.calibration, view.motion);
      for (const Point& point : points_of(view, {named.name, named.camera, 0})) {
        Vector2<double> u;
        ASSERT_TRUE(projection.project_roughly(point.d, &u));
        EXPECT_LT((u - point.u).norm(), 1) << named.name << ' ' << line_delay;
      }
    }
  }
}

// Turning one way the image runs along with the rows, and faster than they are read out: the pixels where a
// direction is seen on its own row lie the wrong way from the middle. The other way it meets them, once.
TEST(ViewProjection, HasNoPixelWhereTheImageOutrunsTheReadOut) {
  View view;
  view.calibration.camera = {3000, 1, {0}, 640, 480};
  view.calibration.line_delay = 50e-6;
  int outrun = 0;
  for (const double rate : {-10.0, 10.0}) {
    view.motion = {{0, 0}, {0, rate}, 240};
    const ViewProjection projection(view.calibration, view.motion);
    for (const double v : {200.0, 230.0, 270.0}) {
      const Vector3<double> d(1, 0, (v - 240) / 3000);
      const bool is_outrun = view.per_row(d.normalized(), 240).y() >= 1;
      Vector2<double> u;
      SeenDirection seen;
      EXPECT_EQ(projection.project(d.normalized(), &u), !is_outrun) << rate << ' ' << v;
      EXPECT_EQ(projection.project(d.normalized(), &seen), !is_outrun) << rate << ' ' << v;
      outrun += is_outrun ? 1 : 0;
    }
  }
  EXPECT_EQ(outrun, 3);
}

TEST(ViewProjection, RefusesWhatTheCameraDoesNotSee) {
  for_all_views([&](const View& view, const NamedCamera& named) {
    const ViewProjection projection(view.calibration, view.motion);
    const Matrix3<double> R = R_base_from_camera(
        view.calibration.mechanics,
        angle_at_row(view.motion, view.calibration.line_delay, view.middle_row()));
    Vector2<double> u(7, 7);
    SeenDirection seen;
    const auto refused = [&](const Vector3<double>& d_c) {
      const Vector3<double> d = R * d_c.normalized();
      EXPECT_FALSE(projection.project(d, &u)) << d_c.transpose();
      EXPECT_FALSE(projection.project(d, &seen)) << d_c.transpose();
      EXPECT_FALSE(projection.project_roughly(d, &u)) << d_c.transpose();
    };
    refused({0, 0, -1});
    refused({0.3, -0.2, -1});
    refused({std::nan(""), 0, 1});
    refused({0, std::numeric_limits<double>::infinity(), 1});
    // Of the row that looks along the axis.
    const double k =
        camera_at_row(named.camera, view.motion, view.calibration.line_delay, view.middle_row())
            .distortion.radial;
    if (k < -1e-9) refused({1.01 / std::sqrt(-3 * k), 0, 1});
    EXPECT_LT((projection.optical_axis() - R.col(2)).norm(), 1e-12);
  });
}

}  // namespace
}  // namespace alidade::test

#include "core/model/lens/distortion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using Vec2 = Vector2<double>;

std::vector<Vec2> shown_points() {
  return {{0, 0}, {1e-12, 0}, {0.3, -0.2}, {-0.45, 0.4}, {0, 0.6}};
}

std::vector<BrownDistortion<double>> brown_lenses() {
  return {{}, {-0.28, 0.08, 1e-3, -2e-3}, {0.3, -0.05, -1e-3, 5e-4}, {0, 0, 0.01, 0.02}};
}

// The camera's kind, with each term alone and all together.
std::vector<Distortion<double>> camera_lenses() {
  std::vector<Distortion<double>> out(1);
  Distortion<double> all;
  for (int i = 0; i < kDistortionCount; ++i) {
    Distortion<double> alone;
    alone[i] = i % 2 == 0 ? -0.12 : 0.05;
    all[i] = alone[i];
    out.push_back(alone);
  }
  out.push_back(all);
  return out;
}

template <class Kind>
void expect_orders_of_the_model(const Kind& lens, const Kind& scaled, double scale) {
  for (const Vec2& x : shown_points()) {
    Vec2 plain, of_scaled;
    ASSERT_TRUE(lens.distort(x, &plain));
    ASSERT_TRUE(scaled.distort(scale * x, &of_scaled));
    EXPECT_LT((of_scaled - scale * plain).norm(), 1e-14);
  }
}

template <class Kind>
void expect_derivatives_of_the_model(const Kind& lens) {
  for (const Vec2& x : shown_points()) {
    Vec2 x_d;
    Matrix2<double> J;
    ASSERT_TRUE(lens.distort(x, &x_d, &J));
    const auto by_x = test::numeric_jacobian<2, 2>(
        [&](const Vec2& change) -> std::optional<Vec2> {
          Vec2 out;
          if (!lens.distort(x + change, &out)) return std::nullopt;
          return out;
        },
        Vec2(Vec2::Constant(1e-4)));
    EXPECT_LT(test::disagreement(J, by_x, 1e-14), 1) << x.transpose();
  }
}

TEST(Distortion, EachTermHasAPlaceANameAndAnOrder) {
  Distortion<double> lens;
  for (int i = 0; i < kDistortionCount; ++i) lens[i] = i + 1;
  for (int i = 0; i < kDistortionCount; ++i) {
    EXPECT_EQ(lens[i], i + 1);
    EXPECT_EQ(lens.cast<float>()[i], static_cast<float>(i + 1));
    EXPECT_STRNE(Distortion<double>::kNames[static_cast<std::size_t>(i)], "");
  }
  EXPECT_STREQ(Distortion<double>::kNames[0], "radial_distortion");
  EXPECT_EQ(Distortion<double>::kOrders[0], 2);
  const BrownDistortion<double> brown{1, 2, 3, 4};
  for (int i = 0; i < BrownDistortion<double>::kCount; ++i) EXPECT_EQ(brown[i], i + 1);
}

// Scaling the picture of directions by s multiplies a term of order n by s^-n.
TEST(Distortion, OrdersAreThoseOfTheModel) {
  constexpr double kScale = 1.3;
  for (const Distortion<double>& lens : camera_lenses()) {
    Distortion<double> scaled;
    for (int i = 0; i < kDistortionCount; ++i) {
      const int order = Distortion<double>::kOrders[static_cast<std::size_t>(i)];
      scaled[i] = lens[i] / std::pow(kScale, order);
    }
    expect_orders_of_the_model(lens, scaled, kScale);
  }
  for (const BrownDistortion<double>& lens : brown_lenses()) {
    std::array<double, BrownDistortion<double>::kCount> terms{};
    for (std::size_t i = 0; i < terms.size(); ++i) {
      terms[i] = lens[static_cast<int>(i)] / std::pow(kScale, BrownDistortion<double>::kOrders[i]);
    }
    expect_orders_of_the_model(lens, {terms[0], terms[1], terms[2], terms[3]}, kScale);
  }
}

TEST(Distortion, BrownWithOneTermIsTheCameras) {
  for (const double k : {-0.3, 0.0, 0.2}) {
    for (const Vec2& x : shown_points()) {
      Vec2 one, four;
      Matrix2<double> J_one, J_four;
      ASSERT_TRUE(RadialDistortion<double>{k}.distort(x, &one, &J_one));
      ASSERT_TRUE((BrownDistortion<double>{k, 0, 0, 0}.distort(x, &four, &J_four)));
      EXPECT_LT((one - four).norm(), 1e-15);
      EXPECT_LT((J_one - J_four).norm(), 1e-15);
    }
  }
}

TEST(Distortion, DerivativesAreThoseOfTheModel) {
  for (const Distortion<double>& lens : camera_lenses()) expect_derivatives_of_the_model(lens);
  for (const BrownDistortion<double>& lens : brown_lenses()) expect_derivatives_of_the_model(lens);
}

TEST(Distortion, UndistortIsTheInverse) {
  for (const Vec2& x : shown_points()) {
    for (const Distortion<double>& lens : camera_lenses()) {
      Vec2 x_d;
      Distortion<double>::Undistorted back;
      ASSERT_TRUE(lens.distort(x, &x_d));
      ASSERT_TRUE(lens.undistort(x_d, &back));
      EXPECT_LT((back.x - x).norm(), 1e-12);
    }
    for (const BrownDistortion<double>& lens : brown_lenses()) {
      Vec2 x_d, back;
      ASSERT_TRUE(lens.distort(x, &x_d));
      ASSERT_TRUE(lens.undistort(x_d, 1e-13, &back));
      EXPECT_LT((back - x).norm(), 1e-12);
    }
  }
}

TEST(Distortion, NothingIsShownBeyondTheTurningPoint) {
  Vec2 out(7, 7);
  const BrownDistortion<double> barrel{-0.3, 0, 0, 0};  // turns back at a radius of 1.054
  EXPECT_TRUE(barrel.distort({1.05, 0}, &out));
  out = {7, 7};
  EXPECT_FALSE(barrel.distort({1.06, 0}, &out));
  EXPECT_FALSE(barrel.undistort({0.8, 0}, 1e-12, &out));  // the largest shown is 0.703
  // 1 + 5 k2 r^4 = 0 at a radius of 1.19
  EXPECT_TRUE((BrownDistortion<double>{0, -0.1, 0, 0}.distort({0, 1.18}, &out)));
  out = {7, 7};
  EXPECT_FALSE((BrownDistortion<double>{0, -0.1, 0, 0}.distort({0, 1.2}, &out)));
  RadialDistortion<double>::Undistorted undistorted;
  EXPECT_FALSE((RadialDistortion<double>{-0.3}.undistort({0.8, 0}, &undistorted)));
  EXPECT_EQ(out, Vec2(7, 7));
}

}  // namespace
}  // namespace alidade

#include "core/calibration/partial_inverse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <vector>

namespace alidade::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Positive definite, its rows of units that are ten orders of magnitude apart.
Eigen::MatrixXd covariance_of_units(int size) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd root =
      Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
  const Eigen::VectorXd unit = Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index i) {
    return std::pow(10.0, -static_cast<double>(10 * i) / (size - 1));
  });
  return unit.asDiagonal() * (root * root.transpose() + Eigen::MatrixXd::Identity(size, size)) *
         unit.asDiagonal();
}

TEST(PartialInverse, IsTheInverseWhateverTheUnits) {
  const Eigen::MatrixXd covariance = covariance_of_units(6);
  const Eigen::MatrixXd product = covariance * scaled_inverse(covariance);
  // Of row i and column j in units of the diagonal.
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd error = sigma.cwiseInverse().asDiagonal() * product * sigma.asDiagonal() -
                                Eigen::MatrixXd::Identity(6, 6);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(PartialInverse, LeavesOutWhatIsExact) {
  Eigen::MatrixXd covariance = covariance_of_units(6);
  for (const int exact : {0, 3}) {
    covariance.row(exact).setZero();
    covariance.col(exact).setZero();
  }
  const std::vector<int> places = free_places(covariance);
  ASSERT_THAT(places, ElementsAre(1, 2, 4, 5));
  const Eigen::MatrixXd information = inverse_over(covariance, places);
  EXPECT_EQ(information.row(0).norm() + information.col(3).norm(), 0);
  const Eigen::MatrixXd part = information(places, places);
  EXPECT_EQ(part, scaled_inverse(covariance(places, places)));
  // What a parameter's information is, is what the others leave of it.
  EXPECT_GE(information(1, 1) * covariance(1, 1), 1);
}

TEST(PartialInverse, IsEmptyWhereThereIsNone) {
  Eigen::MatrixXd covariance = covariance_of_units(3);
  EXPECT_EQ(inverse_over(covariance, {}).size(), 0);
  covariance(0, 1) = covariance(1, 0) = 2 * std::sqrt(covariance(0, 0) * covariance(1, 1));
  EXPECT_EQ(scaled_inverse(covariance).size(), 0);
  EXPECT_EQ(inverse_over(covariance, {0, 1}).size(), 0);
  EXPECT_NE(inverse_over(covariance, {0, 2}).size(), 0);
  EXPECT_THAT(free_places(-covariance), IsEmpty());
}

}  // namespace
}  // namespace alidade::internal

#pragma once
// The minimum of an adjustment, with what tests of its residuals need.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "core/calibration/adjustment.h"

namespace alidade::test {

struct AdjustmentMinimum {
  ::alidade::internal::AdjustmentState state;
  ::alidade::internal::Linearisation at;
  ::alidade::internal::GlobalVector step =
      ::alidade::internal::GlobalVector::Zero();  // of the parameters, from the start
  ::alidade::internal::GlobalMatrix covariance = ::alidade::internal::GlobalMatrix::Zero();
  ::alidade::internal::ReducedFactor factor;
};

// By this many steps of least squares. The latest covariance() of the adjustment is of the minimum.
inline AdjustmentMinimum find_minimum(const ::alidade::internal::AdjustmentState& start, int steps,
                                      ::alidade::internal::Adjustment* adjustment) {
  AdjustmentMinimum out;
  out.state = start;
  Eigen::VectorXd x;
  std::vector<Vector2<double>> x_landmark;
  for (int k = 0; k < steps; ++k) {
    adjustment->linearise(out.state, {}, &out.at);
    EXPECT_TRUE(adjustment->solve(out.at, 0, &x, &x_landmark));
    ::alidade::internal::apply_step(x, x_landmark, &out.state);
    out.step += x.tail<::alidade::internal::kGlobalCount>();
  }
  adjustment->linearise(out.state, {}, &out.at);
  double telemetry_unknowns = 0;
  EXPECT_TRUE(adjustment->covariance(out.at, &out.covariance, &telemetry_unknowns));
  EXPECT_TRUE(adjustment->factorise(out.at, &out.factor));
  return out;
}

}  // namespace alidade::test

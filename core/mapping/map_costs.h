#pragma once
// The terms of map_adjustment.h as Ceres cost functions with Jacobians. Parameter blocks: of a
// picture (xi, eps) with R = R_start Exp(xi); of a landmark the change of its start direction; of
// the lens its control points, and hold. SeenCost fails if the landmark has no pixel, the others
// never.

#include <ceres/sized_cost_function.h>

#include "core/mapping/map_adjustment.h"

namespace alidade::internal {

inline constexpr int kPictureBlock = 4;

// Parameters: picture, landmark, the four control points at the picture's position, hold. Residual:
// error over sigma.
class SeenCost
    : public ceres::SizedCostFunction<2, kPictureBlock, 2, kLensQuantityCount, kLensQuantityCount,
                                      kLensQuantityCount, kLensQuantityCount, 1> {
 public:
  // All arguments except the observation must outlive this object, and must not change. Only knots,
  // image size and aspect of the lens are used, not its control points, which may change.
  SeenCost(const MapPicture* picture, const LensCurve* lens, const Vector3<double>* d_start,
           const MapObservation& seen);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const MapPicture* picture_;
  const LensCurve* lens_;
  const Vector3<double>* d_start_;
  Vector2<double> u_;
  double sigma_px_;
  LensCurve::Basis basis_;
};

// Priors of a picture: telemetry and eps.
class PicturePriorCost : public ceres::SizedCostFunction<4, kPictureBlock> {
 public:
  PicturePriorCost(const Matrix3<double>& R_start, const std::optional<OrientationPrior>& telemetry,
                   double eps_sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Matrix3<double> R_prior_from_start_;
  Matrix3<double> root_information_;  // 0 without telemetry
  double eps_sigma_;
};

// (x - level) / sigma
class LensLevelCost : public ceres::SizedCostFunction<kLensQuantityCount, kLensQuantityCount> {
 public:
  LensLevelCost(const LensQuantities& level, const LensQuantities& sigma)
      : level_(level), sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  LensQuantities level_, sigma_;
};

// (x_a - 2 x_b + x_c) / sigma
class LensBendCost : public ceres::SizedCostFunction<kLensQuantityCount, kLensQuantityCount,
                                                     kLensQuantityCount, kLensQuantityCount> {
 public:
  explicit LensBendCost(const LensQuantities& sigma) : sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  LensQuantities sigma_;
};

// (hold - level) / sigma
class HoldPriorCost : public ceres::SizedCostFunction<1, 1> {
 public:
  HoldPriorCost(double level, double sigma) : level_(level), sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double level_, sigma_;
};

}  // namespace alidade::internal

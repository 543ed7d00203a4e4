#pragma once
// The terms of map_adjustment.h as Ceres cost functions with Jacobians. Parameter blocks: of a
// picture (xi, eps) with R = R_start Exp(xi), and the change of its motion (w, zoom rate); of a
// landmark the change of its start direction; of the lens its control points, and hold. SeenCost
// fails if the landmark has no pixel, the others never.

#include <ceres/sized_cost_function.h>

#include "core/mapping/map_adjustment.h"

namespace alidade::internal {

inline constexpr int kPictureBlock = 4;
inline constexpr int kMotionBlock = 4;

// Parameters: picture, landmark, the four control points at the picture's position, hold, motion.
// Residual: error over sigma.
class SeenCost
    : public ceres::SizedCostFunction<2, kPictureBlock, 2, kLensQuantityCount, kLensQuantityCount,
                                      kLensQuantityCount, kLensQuantityCount, 1, kMotionBlock> {
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

// The change of a picture's motion over its sigma.
class MotionPriorCost : public ceres::SizedCostFunction<kMotionBlock, kMotionBlock> {
 public:
  // sigma: an entry below what a picture can show counts as that.
  explicit MotionPriorCost(const Vector4<double>& sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Vector4<double> information_;  // 1 / sigma
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

// (x_a - 2 x_b + x_c - bend) / sigma
class LensBendCost : public ceres::SizedCostFunction<kLensQuantityCount, kLensQuantityCount,
                                                     kLensQuantityCount, kLensQuantityCount> {
 public:
  LensBendCost(const LensQuantities& bend, const LensQuantities& sigma)
      : bend_(bend), sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  LensQuantities bend_, sigma_;
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

#include "core/mapping/map_costs.h"

#include <Eigen/Cholesky>

#include "core/mapping/map_projection.h"
#include "core/model/direction.h"

namespace alidade::internal {
namespace {

template <int kRows, int kColumns>
using JacobianRows = Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>>;

using LensRows = JacobianRows<kLensQuantityCount, kLensQuantityCount>;

}  // namespace

SeenCost::SeenCost(const MapPicture* picture, const LensCurve* lens, const Vector3<double>* d_start,
                   const MapObservation& seen)
    : picture_(picture),
      lens_(lens),
      d_start_(d_start),
      u_(seen.u),
      sigma_px_(seen.sigma_px),
      basis_(lens->basis_at(picture->position)) {}

bool SeenCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  const Vector3<double> xi = Eigen::Map<const Vector3<double>>(parameters[0]);
  LensQuantities x = LensQuantities::Zero();
  for (int i = 0; i < 4; ++i) {
    x += basis_.weight[i] * Eigen::Map<const LensQuantities>(parameters[2 + i]);
  }
  LensCurve::Jacobians by;
  const Camera<double> camera =
      lens_->camera(picture_->position, x, parameters[0][3], parameters[6][0], &by);
  Matrix<double, 3, 2> J_d;
  const Vector3<double> d = direction_plus(
      *d_start_, Vector2<double>(Eigen::Map<const Vector2<double>>(parameters[1])), &J_d);
  PictureMotion motion = picture_->motion;
  motion.angular_velocity += Eigen::Map<const Vector3<double>>(parameters[7]);
  motion.zoom_rate += parameters[7][3];
  MapProjection seen;
  if (project_from_map(camera, motion, picture_->R_start * exp_so3(xi), u_.y(), d, &seen) !=
      ProjectionStatus::kOk) {
    return false;
  }
  Eigen::Map<Vector2<double>> out(residuals);
  out = (seen.u - u_) / sigma_px_;
  if (jacobians == nullptr) return true;
  const Matrix<double, 2, kLensQuantityCount> J_x = seen.J_u_camera * by.J_x / sigma_px_;
  if (jacobians[0] != nullptr) {
    JacobianRows<2, kPictureBlock> J(jacobians[0]);
    J << seen.J_u_xi * right_jacobian_so3(xi) / sigma_px_, seen.J_u_camera * by.J_eps / sigma_px_;
  }
  if (jacobians[1] != nullptr) {
    JacobianRows<2, 2> J(jacobians[1]);
    J = seen.J_u_d * J_d / sigma_px_;
  }
  for (int i = 0; i < 4; ++i) {
    if (jacobians[2 + i] == nullptr) continue;
    JacobianRows<2, kLensQuantityCount> J(jacobians[2 + i]);
    J = basis_.weight[i] * J_x;
  }
  if (jacobians[6] != nullptr) {
    Eigen::Map<Vector2<double>> J(jacobians[6]);
    J = seen.J_u_camera * by.J_hold / sigma_px_;
  }
  if (jacobians[7] != nullptr) {
    JacobianRows<2, kMotionBlock> J(jacobians[7]);
    J = seen.J_u_motion / sigma_px_;
  }
  return true;
}

PicturePriorCost::PicturePriorCost(const Matrix3<double>& R_start,
                                   const std::optional<OrientationPrior>& telemetry,
                                   double eps_sigma)
    : R_prior_from_start_(telemetry
                              ? Matrix3<double>(telemetry->R_base_from_camera.transpose() * R_start)
                              : Matrix3<double>(Matrix3<double>::Identity())),
      root_information_(Matrix3<double>::Zero()),
      eps_sigma_(eps_sigma) {
  if (!telemetry) return;
  const Matrix3<double> information = telemetry->covariance.inverse();
  root_information_ = information.llt().matrixU();
}

bool PicturePriorCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Vector3<double> xi = Eigen::Map<const Vector3<double>>(parameters[0]);
  const Vector3<double> off = log_so3(Matrix3<double>(R_prior_from_start_ * exp_so3(xi)));
  Eigen::Map<Vector4<double>> out(residuals);
  out << root_information_ * off, parameters[0][3] / eps_sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    JacobianRows<4, kPictureBlock> J(jacobians[0]);
    J.setZero();
    J.topLeftCorner<3, 3>() =
        root_information_ * right_jacobian_inverse_so3(off) * right_jacobian_so3(xi);
    J(3, 3) = 1 / eps_sigma_;
  }
  return true;
}

MotionPriorCost::MotionPriorCost(const Vector4<double>& sigma) {
  constexpr double kLeast = 1e-6;  // rad/s, 1/s
  information_ = sigma.cwiseMax(kLeast).cwiseInverse();
}

bool MotionPriorCost::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  Eigen::Map<Vector4<double>> out(residuals);
  out = Eigen::Map<const Vector4<double>>(parameters[0]).cwiseProduct(information_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    JacobianRows<kMotionBlock, kMotionBlock> J(jacobians[0]);
    J = information_.asDiagonal();
  }
  return true;
}

bool LensLevelCost::Evaluate(double const* const* parameters, double* residuals,
                             double** jacobians) const {
  Eigen::Map<LensQuantities> out(residuals);
  out = (Eigen::Map<const LensQuantities>(parameters[0]) - level_).cwiseQuotient(sigma_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    LensRows J(jacobians[0]);
    J = sigma_.cwiseInverse().asDiagonal();
  }
  return true;
}

bool LensBendCost::Evaluate(double const* const* parameters, double* residuals,
                            double** jacobians) const {
  constexpr double kWeights[3] = {1, -2, 1};
  LensQuantities bend = -bend_;
  for (int i = 0; i < 3; ++i) bend += kWeights[i] * Eigen::Map<const LensQuantities>(parameters[i]);
  Eigen::Map<LensQuantities> out(residuals);
  out = bend.cwiseQuotient(sigma_);
  for (int i = 0; jacobians != nullptr && i < 3; ++i) {
    if (jacobians[i] == nullptr) continue;
    LensRows J(jacobians[i]);
    J = (kWeights[i] * sigma_.cwiseInverse()).asDiagonal();
  }
  return true;
}

bool HoldPriorCost::Evaluate(double const* const* parameters, double* residuals,
                             double** jacobians) const {
  residuals[0] = (parameters[0][0] - level_) / sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = 1 / sigma_;
  return true;
}

}  // namespace alidade::internal

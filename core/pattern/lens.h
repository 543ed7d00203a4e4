#pragma once
// The lens of a camera that sees a known pattern: perspective with the distortion of OpenCV. Camera
// frame RDF.
//   u = (f_u x_d1 + c_u, f_v x_d2 + c_v),   x_d = distortion(x), x = (p_1, p_2) / p_3
// Pixels are continuous; the centre of the top-left pixel is at (0.5, 0.5), so c_u, c_v are
// OpenCV's plus 0.5. Row v is exposed at t0 + v * line_delay. With f_u = f_v, a centre in the
// middle and k2 = p1 = p2 = 0 it is the camera of core/model/lens/camera.h.

#include <array>

#include "core/model/lens/distortion.h"
#include "core/model/linear_algebra.h"
#include "core/model/projection_status.h"

namespace alidade {

enum class LensParameter {
  kFocalLengthU,  // px
  kFocalLengthV,  // px
  kCentreU,       // px
  kCentreV,       // px
  kK1,            // the distortion's terms, in their order
  kK2,
  kP1,
  kP2,
  kLineDelay,  // s/row, any sign
};
inline constexpr int kLensParameterCount = 9;
inline constexpr std::array<const char*, kLensParameterCount> kLensParameterNames = {
    "focal_length_u",
    "focal_length_v",
    "optical_centre_u",
    "optical_centre_v",
    "k1",
    "k2",
    "p1",
    "p2",
    "line_delay"};

[[nodiscard]] constexpr int index(LensParameter parameter) { return static_cast<int>(parameter); }

// Indexed by LensParameter.
using LensVector = Matrix<double, kLensParameterCount, 1>;
using LensMatrix = Matrix<double, kLensParameterCount, kLensParameterCount>;

// Knowledge of a lens besides the data.
struct LensKnowledge {
  std::array<bool, kLensParameterCount> fixed = {};  // to the mean
  LensVector mean = LensVector::Zero();
  LensMatrix information = LensMatrix::Zero();  // inverse covariance; 0: nothing is known
};

[[nodiscard]] inline BrownDistortion<double> distortion_of(const LensVector& lens) {
  return {lens[index(LensParameter::kK1)], lens[index(LensParameter::kK2)],
          lens[index(LensParameter::kP1)], lens[index(LensParameter::kP2)]};
}

// p_c: m, or any unit. J_u_lens is 0 in the line delay's column. Outputs are written with kOk only.
[[nodiscard]] inline ProjectionStatus project_lens(
    const LensVector& lens, const Vector3<double>& p_c, Vector2<double>* u,
    Matrix<double, 2, 3>* J_u_p = nullptr,
    Matrix<double, 2, kLensParameterCount>* J_u_lens = nullptr) {
  if (!all_finite(p_c)) return ProjectionStatus::kNotFinite;
  if (p_c.z() <= 0) return ProjectionStatus::kBehindCamera;
  const double f_u = lens[index(LensParameter::kFocalLengthU)];
  const double f_v = lens[index(LensParameter::kFocalLengthV)];
  const BrownDistortion<double> distortion = distortion_of(lens);
  const Vector2<double> x(p_c.x() / p_c.z(), p_c.y() / p_c.z());
  Vector2<double> x_d;
  Matrix2<double> J_u_x;
  if (!distortion.distort(x, &x_d, J_u_p != nullptr ? &J_u_x : nullptr)) {
    return ProjectionStatus::kBeyondDistortionLimit;
  }
  const Vector2<double> pixel(f_u * x_d.x() + lens[index(LensParameter::kCentreU)],
                              f_v * x_d.y() + lens[index(LensParameter::kCentreV)]);
  if (!all_finite(pixel)) return ProjectionStatus::kNotFinite;
  *u = pixel;
  if (J_u_p != nullptr) {
    J_u_x.row(0) *= f_u / p_c.z();
    J_u_x.row(1) *= f_v / p_c.z();
    *J_u_p << J_u_x, -J_u_x * x;
  }
  if (J_u_lens != nullptr) {
    J_u_lens->setZero();
    (*J_u_lens)(0, index(LensParameter::kFocalLengthU)) = x_d.x();
    (*J_u_lens)(1, index(LensParameter::kFocalLengthV)) = x_d.y();
    J_u_lens->middleCols<2>(index(LensParameter::kCentreU)).setIdentity();
    J_u_lens->middleCols<BrownDistortion<double>::kCount>(index(LensParameter::kK1)) =
        distortion.by_terms(x, f_u, f_v);
  }
  return ProjectionStatus::kOk;
}

}  // namespace alidade

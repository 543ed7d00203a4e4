#pragma once
// The lens of a camera that sees a known pattern: perspective with radial and tangential distortion
// (OpenCV's k1 k2 p1 p2). Camera frame RDF.
//   x = (p_1, p_2) / p_3,   r^2 = |x|^2,   s = 1 + k1 r^2 + k2 r^4
//   x_d = s x + (2 p1 x_1 x_2 + p2 (r^2 + 2 x_1^2),  p1 (r^2 + 2 x_2^2) + 2 p2 x_1 x_2)
//   u = (f_u x_d1 + c_u, f_v x_d2 + c_v)
// Pixels are continuous; the centre of the top-left pixel is at (0.5, 0.5), so c_u, c_v are
// OpenCV's plus 0.5. Row v is exposed at t0 + v * line_delay. With f_u = f_v, a centre in the
// middle and k2 = p1 = p2 = 0 it is the camera of core/model/camera.h.

#include <array>

#include "core/model/linear_algebra.h"
#include "core/model/projection_status.h"

namespace alidade {

enum class LensParameter {
  kFocalLengthU,  // px
  kFocalLengthV,  // px
  kCentreU,       // px
  kCentreV,       // px
  kK1,
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

// p_c: m, or any unit. J_u_lens is 0 in the line delay's column. Outputs are written with kOk only.
[[nodiscard]] inline ProjectionStatus project_lens(
    const LensVector& lens, const Vector3<double>& p_c, Vector2<double>* u,
    Matrix<double, 2, 3>* J_u_p = nullptr,
    Matrix<double, 2, kLensParameterCount>* J_u_lens = nullptr) {
  if (!all_finite(p_c)) return ProjectionStatus::kNotFinite;
  if (p_c.z() <= 0) return ProjectionStatus::kBehindCamera;
  const double f_u = lens[index(LensParameter::kFocalLengthU)];
  const double f_v = lens[index(LensParameter::kFocalLengthV)];
  const double k1 = lens[index(LensParameter::kK1)];
  const double k2 = lens[index(LensParameter::kK2)];
  const double p1 = lens[index(LensParameter::kP1)];
  const double p2 = lens[index(LensParameter::kP2)];
  const double x = p_c.x() / p_c.z();
  const double y = p_c.y() / p_c.z();
  const double r2 = x * x + y * y;
  // Beyond this the radial term turns back, and two directions share a pixel.
  if (1 + r2 * (3 * k1 + 5 * k2 * r2) <= 0) return ProjectionStatus::kBeyondDistortionLimit;
  const double s = 1 + r2 * (k1 + k2 * r2);
  const double x_d = s * x + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double y_d = s * y + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  const Vector2<double> pixel(f_u * x_d + lens[index(LensParameter::kCentreU)],
                              f_v * y_d + lens[index(LensParameter::kCentreV)]);
  if (!all_finite(pixel)) return ProjectionStatus::kNotFinite;
  *u = pixel;
  if (J_u_p != nullptr) {
    const double s_r2 = k1 + 2 * k2 * r2;  // d s / d r^2
    Matrix2<double> J_xd_x;
    J_xd_x << s + 2 * s_r2 * x * x + 2 * p1 * y + 6 * p2 * x,
        2 * s_r2 * x * y + 2 * p1 * x + 2 * p2 * y, 2 * s_r2 * x * y + 2 * p1 * x + 2 * p2 * y,
        s + 2 * s_r2 * y * y + 6 * p1 * y + 2 * p2 * x;
    J_xd_x.row(0) *= f_u / p_c.z();
    J_xd_x.row(1) *= f_v / p_c.z();
    *J_u_p << J_xd_x, -J_xd_x * Vector2<double>(x, y);
  }
  if (J_u_lens != nullptr) {
    *J_u_lens << x_d, 0, 1, 0, f_u * x * r2, f_u * x * r2 * r2, f_u * 2 * x * y,
        f_u * (r2 + 2 * x * x), 0,  //
        0, y_d, 0, 1, f_v * y * r2, f_v * y * r2 * r2, f_v * (r2 + 2 * y * y), f_v * 2 * x * y, 0;
  }
  return ProjectionStatus::kOk;
}

}  // namespace alidade

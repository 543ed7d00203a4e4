#pragma once
// Short names for the fixed-size Eigen types of the model. The geometry in core/model is templates
// on the scalar S: float, double or an automatic-differentiation type such as ceres::Jet. It calls
// sin, sqrt, ... through argument-dependent lookup. Nothing here allocates or throws.
//
// Names: R_a_from_b rotates coordinates of frame b into frame a; d_a is a unit vector in frame a;
// J_out_in is the Jacobian of out with respect to in. A Jacobian argument is an optional output
// pointer: nullptr, the default, costs nothing.

#include <Eigen/Core>
#include <cmath>

namespace alidade {

template <class S, int kRows, int kColumns>
using Matrix = Eigen::Matrix<S, kRows, kColumns>;

template <class S>
using Vector2 = Matrix<S, 2, 1>;
template <class S>
using Vector3 = Matrix<S, 3, 1>;
template <class S>
using Vector4 = Matrix<S, 4, 1>;
template <class S>
using Matrix2 = Matrix<S, 2, 2>;
template <class S>
using Matrix3 = Matrix<S, 3, 3>;
template <class S>
using Matrix4 = Matrix<S, 4, 4>;

// C++20's std::type_identity_t. S is not deduced from a parameter of type NonDeduced<T>, so callers
// may pass Eigen expressions and nullptr.
template <class T>
struct TypeIdentity {
  using type = T;
};
template <class T>
using NonDeduced = typename TypeIdentity<T>::type;

// True if every coefficient is finite (the value part, for a differentiation type).
template <class S, int kRows, int kColumns>
[[nodiscard]] bool all_finite(const Matrix<S, kRows, kColumns>& m) {
  using std::isfinite;
  for (int i = 0; i < m.size(); ++i) {
    if (!isfinite(m.coeff(i))) return false;
  }
  return true;
}

// Removes the asymmetry of a covariance that rounding causes.
template <int kSize>
[[nodiscard]] Matrix<double, kSize, kSize> symmetric(const Matrix<double, kSize, kSize>& m) {
  return 0.5 * (m + m.transpose());
}

}  // namespace alidade

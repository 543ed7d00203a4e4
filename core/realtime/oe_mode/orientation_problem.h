#pragma once
// Sums of a frame's solution: landmarks and prior as a linear problem. Times are in units of half
// the read-out. Internal to orientation_solve.h's files.

#include <Eigen/LU>
#include <array>

#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade::internal {

// One landmark's part of the sums. Times are in units of half the read-out.
struct Term {
  Matrix2<double> information;  // 1/px^2
  Matrix2<double> JtWJ;
  Matrix<double, 2, 2> JtW;
  double t;
};

// The unknowns without the offset. phi is 0 if it is not an unknown.
struct MotionAndLens {
  Vector6 x = Vector6::Zero();  // scaled
  double phi = 0;
  Vector2<double> zoom = Vector2<double>::Zero();  // scaled; of a frame's own lens
};

// Unknowns that the residuals depend on.
enum class Unknowns { kMotion, kMotionAndLens, kAll };

// Row of phi in the normal equations of (x, phi):
//   N x - c phi = b,  information phi - c x = b_phi.
struct LensRow {
  Vector6 c = Vector6::Zero();
  double information = 0;
  double b = 0;
};

// Rows of the frame's own lens l, prior included:  N l + C' x - c phi = b.  Landmarks count
// uninflated; instead the prior's information is multiplied by the inflation.
struct ZoomRows {
  Matrix2<double> inverse = Matrix2<double>::Zero();  // of N
  Matrix<double, 6, 2> C = Matrix<double, 6, 2>::Zero();
  Vector2<double> c = Vector2<double>::Zero();
  Vector2<double> b = Vector2<double>::Zero();

  // Eliminates l from the rows of x, or of phi and x.
  void eliminate(Matrix6* of_x, Vector6* right) const {
    const Matrix<double, 6, 2> by = C * inverse;
    *of_x -= by * C.transpose();
    *right -= by * b;
  }
  void eliminate(LensRow* row) const {
    const Vector2<double> by = inverse * c;
    row->c -= C * by;
    row->information -= c.dot(by);
    row->b += by.dot(b);
  }
  // l at x and phi; and the change of l per unit of phi if x changes by x_by_phi.
  [[nodiscard]] Vector2<double> at(const Vector6& x, double phi) const {
    return inverse * (b - C.transpose() * x + c * phi);
  }
  [[nodiscard]] Vector2<double> by_lens(const Vector6& x_by_phi) const {
    return inverse * (c - C.transpose() * x_by_phi);
  }
};

// Prior of l, scaled.
struct ScaledZoomPrior {
  Vector2<double> value;
  Matrix2<double> information;
  Sensitivity<2> sensitivity;
};

class OrientationProblem {
 public:
  // count: at most kMaxFoundLandmarks. landmarks and lens must outlive this object; only `inlier`
  // of a landmark may change. lens: null if phi is known to be 0. zoom: null if the frame's lens is
  // the map's; needs `lens`.
  OrientationProblem(FoundLandmark* landmarks, int count, double unit_s, const LensScale* lens,
                     const ZoomPrior* zoom)
      : landmarks_(landmarks),
        count_(count),
        unit_s_(unit_s),
        lens_(lens),
        zooms_(zoom != nullptr) {
    if (zooms_) {
      const Vector2<double> scale(1, unit_s);
      zoom_.value = scale.cwiseProduct(zoom->value);
      zoom_.information =
          inverse_of((scale.asDiagonal() * zoom->covariance * scale.asDiagonal()).eval());
      zoom_.sensitivity = scale.asDiagonal() * zoom->sensitivity;
    }
    for (int i = 0; i < count; ++i) {
      const FoundLandmark& landmark = landmarks[i];
      Term& term = terms_[static_cast<std::size_t>(i)];
      term.information = inverse_of(landmark.covariance);
      term.JtW = landmark.J_angle.transpose() * term.information;
      term.JtWJ = term.JtW * landmark.J_angle;
      term.t = landmark.time_s / unit_s;
      if (lens != nullptr) s_[static_cast<std::size_t>(i)] = landmark.sensitivity * lens->direction;
    }
  }

  // Normal equations of x, scaled, from landmarks with these weights.
  void normal_equations(const double* weights, Matrix6* N, Vector6* b) const {
    Matrix2<double> A[5];
    Vector2<double> c[3];
    for (Matrix2<double>& a : A) a.setZero();
    for (Vector2<double>& v : c) v.setZero();
    for (int i = 0; i < count_; ++i) {
      if (weights[i] == 0) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      Matrix2<double> a = weights[i] * term.JtWJ;
      Vector2<double> v = weights[i] * (term.JtW * landmarks_[i].residual);
      for (Matrix2<double>& of_power : A) {
        of_power += a;
        a *= term.t;
      }
      for (Vector2<double>& of_power : c) {
        of_power += v;
        v *= term.t;
      }
    }
    *N << A[0], A[1], A[2] / 2,  //
        A[1], A[2], A[3] / 2,    //
        A[2] / 2, A[3] / 2, A[4] / 4;
    *b << c[0], c[1], c[2] / 2;
  }

  // Row of phi from landmarks alone. Needs a lens.
  [[nodiscard]] LensRow lens_row(const double* weights) const {
    LensRow row;
    for (int i = 0; i < count_; ++i) {
      if (weights[i] == 0) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      const Vector2<double> c = weights[i] * (term.JtW * s_[static_cast<std::size_t>(i)]);
      row.c.head<2>() += c;
      row.c.segment<2>(2) += term.t * c;
      row.c.tail<2>() += (0.5 * term.t * term.t) * c;
      const Vector2<double> Ws = weights[i] * (term.information * s_[static_cast<std::size_t>(i)]);
      row.information += Ws.dot(s_[static_cast<std::size_t>(i)]);
      row.b -= Ws.dot(landmarks_[i].residual);
    }
    return row;
  }

  // Change of -lens_row().b with the parameters; inliers only.
  [[nodiscard]] Sensitivity<1> lens_row_of_sensitivities() const {
    Sensitivity<1> row = Sensitivity<1>::Zero();
    for (int i = 0; i < count_; ++i) {
      if (!landmarks_[i].inlier) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      row += (term.information * s_[static_cast<std::size_t>(i)]).transpose() *
             landmarks_[i].sensitivity;
    }
    return row;
  }

  // Right-hand side of normal_equations() with sensitivities in place of residuals; inliers only.
  [[nodiscard]] Sensitivity<6> right_of_sensitivities() const {
    std::array<Sensitivity<2>, 3> c;
    for (Sensitivity<2>& m : c) m.setZero();
    for (int i = 0; i < count_; ++i) {
      if (!landmarks_[i].inlier) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      const Sensitivity<2> v = term.JtW * landmarks_[i].sensitivity;
      c[0] += v;
      c[1] += term.t * v;
      c[2] += (0.5 * term.t * term.t) * v;
    }
    Sensitivity<6> right;
    right << c[0], c[1], c[2];
    return right;
  }

  // Rows of l from landmarks with these weights.
  [[nodiscard]] ZoomRows zoom_rows(const double* weights, double inflation) const {
    ZoomRows rows;
    Matrix2<double> N = inflation * zoom_.information;
    rows.b = N * zoom_.value;
    for (int i = 0; i < count_; ++i) {
      if (weights[i] == 0) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      const Vector2<double>& z = landmarks_[i].by_zoom;
      const Vector2<double> Wz = weights[i] * (term.information * z);
      const Vector2<double> times(1, term.t);
      N += z.dot(Wz) * times * times.transpose();
      rows.b += Wz.dot(landmarks_[i].residual) * times;
      rows.c += Wz.dot(s_[static_cast<std::size_t>(i)]) * times;
      const Vector2<double> v = weights[i] * (term.JtW * z);
      rows.C.topRows<2>() += v * times.transpose();
      rows.C.middleRows<2>(2) += term.t * v * times.transpose();
      rows.C.bottomRows<2>() += (0.5 * term.t * term.t) * v * times.transpose();
    }
    rows.inverse = inverse_of(N);
    return rows;
  }

  // Change of zoom_rows().b with the parameters; inliers only.
  [[nodiscard]] Sensitivity<2> zoom_rows_of_sensitivities(double inflation) const {
    Sensitivity<2> rows = inflation * zoom_.information * zoom_.sensitivity;
    for (int i = 0; i < count_; ++i) {
      if (!landmarks_[i].inlier) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      const Sensitivity<1> of_it =
          (term.information * landmarks_[i].by_zoom).transpose() * landmarks_[i].sensitivity;
      rows.row(0) += of_it;
      rows.row(1) += term.t * of_it;
    }
    return rows;
  }

  // Residual of landmark i at these values. Which unknowns it depends on is a template parameter,
  // so that loops over all landmarks do not branch.
  template <Unknowns unknowns>
  [[nodiscard]] Vector2<double> left(int i, const MotionAndLens& at) const {
    const auto of_it = static_cast<std::size_t>(i);
    Vector2<double> r =
        landmarks_[i].residual - landmarks_[i].J_angle * angle_at(at.x, terms_[of_it].t);
    if constexpr (unknowns == Unknowns::kMotionAndLens) return r + at.phi * s_[of_it];
    if constexpr (unknowns == Unknowns::kAll) {
      return r + at.phi * s_[of_it] -
             (at.zoom[0] + terms_[of_it].t * at.zoom[1]) * landmarks_[i].by_zoom;
    }
    return r;
  }
  [[nodiscard]] Vector2<double> left(int i, const MotionAndLens& at) const {
    if (zooms_) return left<Unknowns::kAll>(i, at);
    return lens_ != nullptr ? left<Unknowns::kMotionAndLens>(i, at)
                            : left<Unknowns::kMotion>(i, at);
  }

  template <Unknowns unknowns>
  [[nodiscard]] double normalised_square(int i, const MotionAndLens& at) const {
    const Vector2<double> r = left<unknowns>(i, at);
    return r.dot(terms_[static_cast<std::size_t>(i)].information * r);
  }

  [[nodiscard]] const Term& term(int i) const { return terms_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const LensScale* lens() const { return lens_; }
  [[nodiscard]] bool zooms() const { return zooms_; }

  // Scaled = D unscaled.
  [[nodiscard]] Vector6 scaling() const {
    Vector6 D;
    D << 1, 1, unit_s_, unit_s_, unit_s_ * unit_s_, unit_s_ * unit_s_;
    return D;
  }

 private:
  FoundLandmark* landmarks_;
  int count_;
  double unit_s_;
  const LensScale* lens_;
  bool zooms_;
  ScaledZoomPrior zoom_;  // if zooms_
  std::array<Term, kMaxFoundLandmarks> terms_;
  // px, d residual / d phi. Separate from the terms, which all solutions read. Not written without
  // a lens.
  std::array<Vector2<double>, kMaxFoundLandmarks> s_;
};

// Telemetry and prior in scaled units.
struct ScaledPrior {
  Matrix6 motion_information;
  Vector6 motion;
  Vector6 motion_b;
  Matrix2<double> rate_information = Matrix2<double>::Zero();
  Vector2<double> rate = Vector2<double>::Zero();
  Matrix4<double> telemetry_information = Matrix4<double>::Zero();
  Vector4<double> telemetry = Vector4<double>::Zero();
  Vector6 motion_by_lens = Vector6::Zero();  // d motion / d phi
  double scale_inflation = 1;
};

[[nodiscard]] inline ScaledPrior scaled(const MotionPrior& prior, double unit_s, const Vector6& D) {
  ScaledPrior out;
  const Vector6 inverse = D.cwiseInverse();
  out.motion_information = inverse.asDiagonal() * prior.motion_information * inverse.asDiagonal();
  out.motion = D.cwiseProduct(prior.motion);
  out.motion_b = out.motion_information * out.motion;
  if (prior.lens != nullptr) {
    out.scale_inflation = prior.scale_inflation;
    out.motion_by_lens = D.cwiseProduct(prior.motion_sensitivity * prior.lens->direction);
  }
  if (prior.has_telemetry) {
    const Vector4<double> D4(1, 1, unit_s, unit_s);
    const Matrix4<double> covariance =
        D4.asDiagonal() * prior.telemetry_covariance * D4.asDiagonal();
    out.telemetry_information = covariance.inverse();
    out.telemetry = D4.cwiseProduct(prior.telemetry);
    out.rate_information = inverse_of(covariance.bottomRightCorner<2, 2>());
    out.rate = out.telemetry.tail<2>();
  }
  return out;
}

}  // namespace alidade::internal

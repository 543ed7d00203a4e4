#include "core/calibration/adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/calibration/landmark_elimination.h"
#include "core/calibration/reduced_equations.h"

namespace alidade::internal {

namespace {

// A pivot of the scaled matrix is 1 minus the share of a parameter that the others explain.
constexpr double kMinPivot = 1e-13;

// Replaces a lower triangle L by L^-1, with a third of the work of solving for the identity.
void invert_lower(Eigen::Ref<Eigen::MatrixXd> L) {
  const auto size = L.rows();
  if (size <= 32) {
    const Eigen::MatrixXd inverse =
        L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(size, size));
    L.triangularView<Eigen::Lower>() = inverse;
    return;
  }
  const auto half = size / 2;
  auto below = L.bottomLeftCorner(size - half, half);
  L.bottomRightCorner(size - half, size - half).triangularView<Eigen::Lower>().solveInPlace(below);
  L.topLeftCorner(half, half).triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(below);
  below *= -1;
  invert_lower(L.topLeftCorner(half, half));
  invert_lower(L.bottomRightCorner(size - half, size - half));
}

bool solve_iteratively(const Linearisation& in, double damping, Eigen::VectorXd* x) {
  constexpr double kTolerance = 1e-4;  // of a step, which is not exact either
  ReducedEquations equations;
  return equations.set(in, damping) && equations.solve(equations.g(), kTolerance, x) &&
         x->allFinite();
}

bool solve_columns_iteratively(const Linearisation& in, const Eigen::MatrixXd& b,
                               Eigen::MatrixXd* x, Eigen::VectorXd* step) {
  constexpr double kTolerance = 1e-6;
  ReducedEquations equations;
  if (!equations.set(in, 0) || !equations.solve(equations.g(), kTolerance, step)) return false;
  x->resize(b.rows(), b.cols());
  Eigen::VectorXd column;
  for (Eigen::Index i = 0; i < b.cols(); ++i) {
    if (!equations.solve(b.col(i), kTolerance, &column)) return false;
    x->col(i) = column;
  }
  return x->allFinite() && step->allFinite();
}

}  // namespace

bool ReducedFactor::set(Eigen::MatrixXd S) {
  scale_ = S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  L_ = scale_.asDiagonal() * S * scale_.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(L_);
  return llt.info() == Eigen::Success;
}

Eigen::MatrixXd ReducedFactor::half_solve(const Eigen::MatrixXd& B) const {
  return L_.triangularView<Eigen::Lower>().solve(scale_.asDiagonal() * B);
}

bool Adjustment::factorise(const Linearisation& in, ReducedFactor* factor) {
  const bool regular = reduce(in, 0) && factor->set(std::move(reduced_));
  forget_reduced();
  return regular;
}

bool Adjustment::reduce(const Linearisation& in, double damping) {
  in.H.copy_to(&reduced_);
  reduced_.diagonal() *= 1 + damping;
  reduced_g_ = in.g;
  const auto camera_row = in.H.rows() - kGlobalCount;
  return eliminate_landmarks(in, damping, [&](const EliminatedLandmark& Y) {
    const int* touched = &in.touched[in.touched_begin[Y.landmark]];
    for (std::size_t i = 0; i < Y.points.size(); ++i) {
      const Matrix2<double>& Y_i = Y.points[i];
      const int row = 2 * touched[i];
      for (std::size_t j = 0; j <= i; ++j) {
        reduced_.block<2, 2>(row, 2 * touched[j]) -= Y_i * Y.points[j].transpose();
      }
      reduced_.block<kObservedCount, 2>(camera_row, row) -= Y.camera * Y_i.transpose();
      reduced_g_.segment<2>(row) -= Y_i * Y.gradient;
    }
    reduced_.block<kObservedCount, kObservedCount>(camera_row, camera_row) -=
        Y.camera * Y.camera.transpose();
    reduced_g_.segment<kObservedCount>(camera_row) -= Y.camera * Y.gradient;
  });
}

bool Adjustment::solve_directly(const Linearisation& in, double damping, Eigen::VectorXd* x) {
  if (!reduce(in, damping)) return false;
  // Scaled to a unit diagonal, so that the parameters' units do not matter.
  const Eigen::VectorXd scale = reduced_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  reduced_ = scale.asDiagonal() * reduced_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(reduced_);
  if (llt.info() != Eigen::Success) return false;
  *x = scale.cwiseProduct(llt.solve(scale.cwiseProduct(reduced_g_)));
  return x->allFinite();
}

bool Adjustment::solve_columns(const Linearisation& in, const Eigen::MatrixXd& b,
                               Eigen::MatrixXd* x, Eigen::VectorXd* step) {
  if (is_long(in) && solve_columns_iteratively(in, b, x, step)) return true;
  if (!reduce(in, 0)) return false;
  const Eigen::VectorXd scale = reduced_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  reduced_ = scale.asDiagonal() * reduced_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(reduced_);
  if (llt.info() != Eigen::Success) return false;
  *x = scale.asDiagonal() * llt.solve(scale.asDiagonal() * b);
  *step = scale.cwiseProduct(llt.solve(scale.cwiseProduct(reduced_g_)));
  forget_reduced();
  return x->allFinite() && step->allFinite();
}

bool Adjustment::solve(const Linearisation& in, double damping, Eigen::VectorXd* x,
                       std::vector<Vector2<double>>* x_landmark) {
  if (!(is_long(in) && solve_iteratively(in, damping, x)) && !solve_directly(in, damping, x))
    return false;
  const auto camera_row = in.H.rows() - kGlobalCount;
  x_landmark->resize(in.H_landmark.size());
  for (std::size_t l = 0; l < in.H_landmark.size(); ++l) {
    Vector2<double> g = in.g_landmark[l];
    for (std::size_t i = in.touched_begin[l]; i < in.touched_begin[l + 1]; ++i) {
      g -= in.H_touched[i].transpose() * x->segment<2>(2 * in.touched[i]);
    }
    if (in.touched_begin[l] == in.touched_begin[l + 1]) {
      (*x_landmark)[l].setZero();
      continue;
    }
    g -= in.H_camera[l].transpose() * x->segment<kObservedCount>(camera_row);
    Matrix2<double> V = in.H_landmark[l];
    V.diagonal() *= 1 + damping;
    (*x_landmark)[l] = V.llt().solve(g);
  }
  return true;
}

bool Adjustment::minimise(const LossScales& loss, int max_steps, double tolerance,
                          AdjustmentState* state, Linearisation* at) {
  const bool done = descend(loss, max_steps, tolerance, state, at);
  forget_reduced();
  return done;
}

bool Adjustment::descend(const LossScales& loss, int max_steps, double tolerance,
                         AdjustmentState* state, Linearisation* at) {
  constexpr double kMaxDamping = 1e8;
  constexpr double kLeastDamping = 1e-10;
  linearise(*state, loss, at);
  if (!at->valid) return false;
  Linearisation next;
  Eigen::VectorXd x;
  std::vector<Vector2<double>> x_landmark;
  for (int step = 0; step < max_steps;) {
    bool accepted = false;
    double promised = 0;
    if (solve(*at, damping_, &x, &x_landmark)) {
      promised = x.dot(at->g);
      for (std::size_t l = 0; l < x_landmark.size(); ++l) {
        promised += x_landmark[l].dot(at->g_landmark[l]);
      }
      for (std::size_t l = 0; l < at->direction_by_nearness.size(); ++l) {
        x_landmark[l] -= at->direction_by_nearness[l] * x_landmark[state->landmarks.size() + l][0];
      }
      AdjustmentState candidate = *state;
      apply_step(x, x_landmark, &candidate);
      linearise(candidate, loss, &next);
      ++steps_taken_;
      ++step;
      // Also accepts a cost that differs by rounding only.
      accepted = next.valid && next.cost <= at->cost + 1e-9 * at->cost;
      if (accepted) {
        *state = std::move(candidate);
        std::swap(*at, next);
      }
    }
    if (accepted) {
      if (promised < tolerance) return true;
      damping_ = std::max(damping_ / 10, kLeastDamping);
    } else {
      damping_ = std::max(damping_ * 10, 1e-5);
      if (damping_ > kMaxDamping) {
        damping_ = kLeastDamping;
        return false;
      }
    }
  }
  return false;
}

bool Adjustment::covariance(const Linearisation& in, GlobalMatrix* covariance,
                            double* telemetry_unknowns) {
  return (is_long(in) && covariance_iteratively(in, covariance, telemetry_unknowns)) ||
         covariance_directly(in, covariance, telemetry_unknowns);
}

bool Adjustment::covariance_directly(const Linearisation& in, GlobalMatrix* covariance,
                                     double* telemetry_unknowns) {
  if (!reduce(in, 0)) return false;
  const auto size = reduced_.rows();
  const Eigen::VectorXd scale = reduced_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  reduced_ = scale.asDiagonal() * reduced_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(reduced_);
  if (llt.info() != Eigen::Success) return false;
  if (reduced_.diagonal().cwiseAbs2().minCoeff() < kMinPivot) return false;
  // H^-1 = S (L^-1)^T L^-1 S. Only control points that share a segment and the parameters are
  // needed.
  invert_lower(reduced_);
  const auto root = [&](Eigen::Index i, Eigen::Index from) {
    return reduced_.col(i).tail(size - from);
  };
  const auto inverse = [&](Eigen::Index i, Eigen::Index j) {
    const auto from = std::max(i, j);
    return scale[i] * scale[j] * root(i, from).dot(root(j, from));
  };
  const auto first_global = size - kGlobalCount;
  global_rows_.setZero(kGlobalCount, size);
  for (int i = 0; i < kGlobalCount; ++i) {
    if (fixed_[static_cast<std::size_t>(i)]) continue;
    for (Eigen::Index j = 0; j < size; ++j) global_rows_(i, j) = inverse(first_global + i, j);
  }
  *covariance = global_rows_.rightCols<kGlobalCount>();
  *telemetry_unknowns = 0;
  in.H_telemetry.for_each([&](Eigen::Index i, Eigen::Index j, double h) {
    if (h != 0) *telemetry_unknowns += (i == j ? 1 : 2) * h * inverse(i, j);
  });
  forget_reduced();
  return true;
}

bool Adjustment::covariance_iteratively(const Linearisation& in, GlobalMatrix* covariance,
                                        double* telemetry_unknowns) {
  constexpr double kTolerance = 1e-6;
  ReducedEquations equations;
  if (!equations.set(in, 0)) return false;
  const auto size = in.H.rows();
  const auto first_global = size - kGlobalCount;
  global_rows_.setZero(kGlobalCount, size);
  Eigen::VectorXd x;
  for (int i = 0; i < kGlobalCount; ++i) {
    if (fixed_[static_cast<std::size_t>(i)]) continue;
    if (!equations.solve(Eigen::VectorXd::Unit(size, first_global + i), kTolerance, &x))
      return false;
    // The pivot that this parameter would have as the last one.
    if (1 < kMinPivot * equations.parameters()(i, i) * x[first_global + i]) return false;
    global_rows_.row(i) = x.transpose();
  }
  *covariance = global_rows_.rightCols<kGlobalCount>();
  *covariance = (0.5 * (*covariance + covariance->transpose())).eval();

  // H_telemetry + ridge = L L^T; the ridge is needed as telemetry does not reach all unknowns. For
  // random signs w the mean of (L w)^T H^-1 L w is the trace (Hutchinson), with a variance of at
  // most 2 / kProbes of it.
  constexpr int kProbes = 8;
  constexpr double kProbeTolerance = 1e-3;
  constexpr double kRidge = 1e-11;
  std::vector<Eigen::Triplet<double>> entries;
  in.H_telemetry.for_each([&](Eigen::Index i, Eigen::Index j, double h) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(j), h);
  });
  in.H.for_each([&](Eigen::Index i, Eigen::Index j, double h) {
    if (i == j) entries.emplace_back(static_cast<int>(i), static_cast<int>(i), kRidge * h);
  });
  Eigen::SparseMatrix<double> H_telemetry(size, size);
  H_telemetry.setFromTriplets(entries.begin(), entries.end());
  const OrderedCholesky llt(H_telemetry);
  if (llt.info() != Eigen::Success) return false;
  std::mt19937 random;
  double trace = 0;
  for (int k = 0; k < kProbes; ++k) {
    Eigen::VectorXd signs(size);
    for (double& sign : signs) sign = (random() & 1) != 0 ? 1 : -1;
    const Eigen::VectorXd b = llt.matrixL() * signs;
    if (!equations.solve(b, kProbeTolerance, &x)) return false;
    trace += b.dot(x) / kProbes;
  }
  *telemetry_unknowns = trace;
  return true;
}

}  // namespace alidade::internal

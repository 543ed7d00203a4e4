#pragma once
// ReducedEquations: S x = b with S = H - Y Y^T (landmark_elimination.h) for long recordings. S is
// dense if a path returns to a scene that was seen before; H and Y are sparse. Conjugate gradients
// need only products with S. So time and memory grow with the observations, not with the square or
// cube of the control points.
// Preconditioner: M = [B C^T; C D], with B the control points' block of H (a band, as if landmarks
// were known), C and D the parameters' rows of S. B minus the same block of S is positive
// semidefinite, so M is positive definite if S is. solve() takes some 20 to 40 steps at any length.
// Allocates. Derivation: docs/calibration.md.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <vector>

#include "core/calibration/landmark_elimination.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Cholesky of a matrix whose own order keeps it sparse.
using OrderedCholesky =
    Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>;

class ReducedEquations {
 public:
  // Multiplies every diagonal element of H and of the landmarks' blocks by 1 + damping. `in` is
  // used by solve(): it must stay as it is until the next set(). False if a landmark's block or M
  // is not positive definite; solve() must not be called then.
  [[nodiscard]] bool set(const Linearisation& in, double damping);

  // The right-hand side with landmarks eliminated: g - Y y.
  [[nodiscard]] const Eigen::VectorXd& g() const { return g_; }
  // The parameters' block of S.
  [[nodiscard]] const GlobalMatrix& parameters() const { return corner_; }

  // After set() returned true. b, x: as many rows as H. Iterates until the error is about
  // `tolerance` times x, both in the norm sqrt(x^T S x). False if this takes more than 200 steps,
  // or if S turns out not to be positive definite.
  [[nodiscard]] bool solve(const Eigen::VectorXd& b, double tolerance, Eigen::VectorXd* x) const;

 private:
  [[nodiscard]] bool factorise();
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& x) const;           // S x
  [[nodiscard]] Eigen::VectorXd preconditioned(const Eigen::VectorXd& r) const;  // M^-1 r

  const Linearisation* in_ = nullptr;
  double damping_ = 0;
  // Rows of Y: of the control points, in the order of in_->touched; of the parameters, by landmark
  // (zero if none of its observations is in use).
  std::vector<Matrix2<double>> Y_points_;
  std::vector<CameraRows> Y_camera_;
  Eigen::VectorXd g_;
  OrderedCholesky band_;
  Eigen::MatrixXd border_;         // C
  Eigen::MatrixXd band_inverse_;   // B^-1 C^T
  GlobalMatrix corner_;            // D
  Eigen::LLT<GlobalMatrix> rest_;  // of D - C B^-1 C^T
};

}  // namespace alidade::internal

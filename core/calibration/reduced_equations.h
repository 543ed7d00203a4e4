#pragma once
// ReducedEquations: S x = b with S = H - Y Y^T (landmark_elimination.h) for long recordings. S is dense where a path returns to what it saw
// before, H and Y are sparse: by conjugate gradients, which need products with S alone, time and memory grow with the observations, and not with
// the square or the cube of the control points.
// The preconditioner is S with the control points' part taken from H, as if landmarks were known, and the parameters' rows as they are:
//   M = [ B  C^T ]   B of H: a band. As B is more than S has there, M is positive definite where S is.
//       [ C   D  ]   C, D of S
// Some 20 to 40 steps at any length (docs/measurements.md). Allocates.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <vector>

#include "core/calibration/landmark_elimination.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Of a matrix whose order keeps it sparse as it is.
using OrderedCholesky =
    Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>;

class ReducedEquations {
 public:
  // Every diagonal element of H multiplied by 1 + damping; `in` must outlive it. False if M is not positive definite.
  [[nodiscard]] bool set(const Linearisation& in, double damping);

  [[nodiscard]] const Eigen::VectorXd& g() const { return g_; }
  // Of S, the parameters' own.
  [[nodiscard]] const GlobalMatrix& parameters() const { return corner_; }

  // Until the error is some `tolerance` of x, both by the norm x^T S x. False where too many steps do not suffice.
  [[nodiscard]] bool solve(const Eigen::VectorXd& b, double tolerance, Eigen::VectorXd* x) const;

 private:
  [[nodiscard]] bool factorise();
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& x) const;           // S x
  [[nodiscard]] Eigen::VectorXd preconditioned(const Eigen::VectorXd& r) const;  // M^-1 r

  const Linearisation* in_ = nullptr;
  double damping_ = 0;
  // Y, of touched control points one after the other, and of the parameters, by landmark: zero where it is not observed.
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

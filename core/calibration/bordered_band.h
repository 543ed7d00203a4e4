#pragma once
// BorderedBand: the normal matrix of the adjustment before landmarks are eliminated. Control points
// of the spline are coupled only if they share a segment. All are coupled with the parameters:
//
//   H = [ B   C^T ]   B: 2x2 blocks of control points up to kReach apart;  C, D: kBorder rows
//       [ C    D  ]
//
// Only the lower triangle of B is stored. A dense H takes 8 bytes times the square of its rows:
// 3 MB with 300 control points.

#include <Eigen/Core>
#include <algorithm>

namespace alidade::internal {

template <int kBorder>
class BorderedBand {
 public:
  static constexpr int kReach = 3;  // control points

  void set_zero(int control_points) {
    band_.setZero(kBandRows, 2 * control_points);
    border_.setZero(kBorder, 2 * control_points + kBorder);
  }
  [[nodiscard]] Eigen::Index rows() const { return border_.cols(); }

  // The 2x2 block of two control points, row - column in 0..kReach. The upper triangle of a
  // diagonal block is not used.
  [[nodiscard]] auto points(int row, int column) {
    return band_.block<2, 2>(2 * (row - column), 2 * column);
  }
  // The rows of the parameters: C, then both triangles of D.
  [[nodiscard]] Eigen::MatrixXd& border() { return border_; }
  [[nodiscard]] const Eigen::MatrixXd& border() const { return border_; }

  BorderedBand& operator+=(const BorderedBand& other) {
    band_ += other.band_;
    border_ += other.border_;
    return *this;
  }

  // The lower triangle of H. Above the diagonal only the diagonal blocks and D are filled; the
  // rest, C^T included, is zero.
  void copy_to(Eigen::MatrixXd* dense) const {
    dense->setZero(rows(), rows());
    const Eigen::Index points = band_.cols();
    for (Eigen::Index column = 0; column < points; ++column) {
      const Eigen::Index first = column / 2 * 2;
      const Eigen::Index count = std::min<Eigen::Index>(kBandRows, points - first);
      dense->col(column).segment(first, count) = band_.col(column).head(count);
    }
    dense->bottomRows<kBorder>() = border_;
  }

  // Calls f(row, column, value) for all of the lower triangle that may differ from zero, column by
  // column.
  template <class Function>
  void for_each(Function f) const {
    const Eigen::Index points = band_.cols();
    for (Eigen::Index column = 0; column < rows(); ++column) {
      if (column < points) {
        const Eigen::Index first = column / 2 * 2;
        const Eigen::Index end = std::min<Eigen::Index>(first + kBandRows, points);
        for (Eigen::Index row = column; row < end; ++row)
          f(row, column, band_(row - first, column));
      }
      for (Eigen::Index row = std::max(column, points); row < rows(); ++row)
        f(row, column, border_(row - points, column));
    }
  }

 private:
  static constexpr int kBandRows = 2 * (kReach + 1);
  Eigen::MatrixXd band_;    // by column, from the diagonal block's first row on
  Eigen::MatrixXd border_;  // kBorder rows
};

}  // namespace alidade::internal

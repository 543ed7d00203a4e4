#include "test/accuracy/optimal_assignment.h"

#include <limits>

namespace alidade::test {

std::vector<int> optimal_assignment(const Eigen::MatrixXd& cost) {
  const int rows = static_cast<int>(cost.rows());
  const int columns = static_cast<int>(cost.cols());
  std::vector<int> column_of(static_cast<std::size_t>(rows), -1);
  if (rows > columns) {
    const std::vector<int> row_of = optimal_assignment(cost.transpose());
    for (int c = 0; c < columns; ++c) {
      column_of[static_cast<std::size_t>(row_of[static_cast<std::size_t>(c)])] = c;
    }
    return column_of;
  }
  // Index 0 stands for "none": rows and columns count from 1.
  const double infinity = std::numeric_limits<double>::infinity();
  const auto size = static_cast<std::size_t>(columns) + 1;
  std::vector<double> row_price(static_cast<std::size_t>(rows) + 1, 0.0);
  std::vector<double> column_price(size, 0.0);
  std::vector<std::size_t> row_of(size, 0);
  std::vector<std::size_t> way(size, 0);
  for (std::size_t row = 1; row <= static_cast<std::size_t>(rows); ++row) {
    row_of[0] = row;
    std::size_t column = 0;
    std::vector<double> distance(size, infinity);
    std::vector<char> done(size, 0);
    do {
      done[column] = 1;
      const std::size_t r = row_of[column];
      double step = infinity;
      std::size_t next = 0;
      for (std::size_t c = 1; c < size; ++c) {
        if (done[c]) continue;
        const double reduced =
            cost(static_cast<Eigen::Index>(r - 1), static_cast<Eigen::Index>(c - 1)) -
            row_price[r] - column_price[c];
        if (reduced < distance[c]) {
          distance[c] = reduced;
          way[c] = column;
        }
        if (distance[c] < step) {
          step = distance[c];
          next = c;
        }
      }
      for (std::size_t c = 0; c < size; ++c) {
        if (done[c]) {
          row_price[row_of[c]] += step;
          column_price[c] -= step;
        } else {
          distance[c] -= step;
        }
      }
      column = next;
    } while (row_of[column] != 0);
    while (column != 0) {
      row_of[column] = row_of[way[column]];
      column = way[column];
    }
  }
  for (std::size_t c = 1; c < size; ++c) {
    if (row_of[c] != 0) column_of[row_of[c] - 1] = static_cast<int>(c) - 1;
  }
  return column_of;
}

}  // namespace alidade::test

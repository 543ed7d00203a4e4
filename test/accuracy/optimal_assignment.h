#pragma once
// The assignment of rows to columns of least total cost: shortest augmenting paths (Jonker, Volgenant 1987), O(n^2 m) for n <= m.
// Of Debian's libraries dlib has one, for integers only and with X11 behind it.

#include <Eigen/Core>
#include <vector>

namespace alidade::test {

// The column of each row; -1 for rows that get none, as there are more of them. Costs are finite.
[[nodiscard]] std::vector<int> optimal_assignment(const Eigen::MatrixXd& cost);

}  // namespace alidade::test

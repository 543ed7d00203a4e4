#pragma once
// A forest stored as the parent of each node; a root is its own parent. Nodes with the same root
// are one group (Tarjan 1975, with path halving). No allocation.

#include <cstddef>
#include <vector>

namespace alidade::internal {

// Root of a node's tree. Shortens the node's path to the root.
[[nodiscard]] inline int root_of(int node, std::vector<int>* parent) {
  while ((*parent)[static_cast<std::size_t>(node)] != node) {
    int& above = (*parent)[static_cast<std::size_t>(node)];
    above = (*parent)[static_cast<std::size_t>(above)];
    node = above;
  }
  return node;
}

}  // namespace alidade::internal

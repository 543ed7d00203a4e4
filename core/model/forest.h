#pragma once
// A forest as the parent of each node, roots their own: which nodes are one group (Tarjan 1975, with halved paths). No allocation.

#include <cstddef>
#include <vector>

namespace alidade::internal {

// Of a node's tree; shortens the way there.
[[nodiscard]] inline int root_of(int node, std::vector<int>* parent) {
  while ((*parent)[static_cast<std::size_t>(node)] != node) {
    int& above = (*parent)[static_cast<std::size_t>(node)];
    above = (*parent)[static_cast<std::size_t>(above)];
    node = above;
  }
  return node;
}

}  // namespace alidade::internal

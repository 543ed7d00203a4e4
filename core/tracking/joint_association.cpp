#include "core/tracking/joint_association.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace alidade {

namespace {
std::size_t at(int i) { return static_cast<std::size_t>(i); }
}  // namespace

JointAssociation::JointAssociation(int max_targets, int max_detections)
    : parent_(at(max_targets)),
      holder_(at(max_detections)),
      first_pair_(at(max_targets) + 1),
      column_(at(max_detections), -1),
      order_(at(max_targets) * at(max_detections)),
      column_sum_(at(max_detections)),
      done_(at(max_targets)),
      target_taken_(at(max_targets)),
      detection_taken_(at(max_detections)) {
  members_.reserve(at(max_targets));
}

int JointAssociation::root_of(int target) {
  while (parent_[at(target)] != target) {
    parent_[at(target)] = parent_[at(parent_[at(target)])];
    target = parent_[at(target)];
  }
  return target;
}

void JointAssociation::find_clusters(int targets, const GatedPair* pairs, int count) {
  std::iota(parent_.begin(), parent_.begin() + targets, 0);
  std::fill(holder_.begin(), holder_.end(), -1);
  for (int i = 0; i < count; ++i) {
    int& holder = holder_[at(pairs[i].detection)];
    if (holder < 0) {
      holder = pairs[i].target;
    } else {
      const int a = root_of(holder);
      const int b = root_of(pairs[i].target);
      parent_[at(std::max(a, b))] = std::min(a, b);
    }
  }
}

void JointAssociation::weigh(AssociationMethod method, const double* missed, int targets,
                             GatedPair* pairs, int count) {
  exact_clusters_ = 0;
  cheap_clusters_ = 0;
  if (method == AssociationMethod::kNearest) {
    pick_nearest(pairs, count);
    return;
  }
  std::fill(column_sum_.begin(), column_sum_.end(), 0.0);
  int next = 0;
  for (int t = 0; t < targets; ++t) {
    first_pair_[at(t)] = next;
    for (; next < count && pairs[next].target == t; ++next) {
      column_sum_[at(pairs[next].detection)] += pairs[next].ratio;
    }
  }
  first_pair_[at(targets)] = next;
  if (method == AssociationMethod::kCheap) {
    for (int t = 0; t < targets; ++t) weigh_cheaply(missed, t, pairs);
    return;
  }

  find_clusters(targets, pairs, count);
  std::fill(done_.begin(), done_.end(), char{0});
  for (int t = 0; t < targets; ++t) {
    if (done_[at(t)] || first_pair_[at(t)] == first_pair_[at(t) + 1]) continue;
    members_.clear();
    int columns = 0;
    for (int u = t; u < targets; ++u) {
      if (root_of(u) != root_of(t) || first_pair_[at(u)] == first_pair_[at(u) + 1]) continue;
      done_[at(u)] = 1;
      members_.push_back(u);
      for (int i = first_pair_[at(u)]; i < first_pair_[at(u) + 1]; ++i) {
        int& column = column_[at(pairs[i].detection)];
        if (column < 0) column = columns++;
      }
    }
    if (static_cast<int>(members_.size()) <= kLargestExactCluster &&
        columns <= kLargestExactCluster) {
      ++exact_clusters_;
      fill_cluster(missed, pairs);
      weigh_exactly(pairs);
    } else {
      ++cheap_clusters_;
      for (const int u : members_) weigh_cheaply(missed, u, pairs);
    }
    for (const int u : members_) {
      for (int i = first_pair_[at(u)]; i < first_pair_[at(u) + 1]; ++i) {
        column_[at(pairs[i].detection)] = -1;
      }
    }
  }
}

void JointAssociation::weigh_cheaply(const double* missed, int target, GatedPair* pairs) {
  const int first = first_pair_[at(target)];
  const int last = first_pair_[at(target) + 1];
  double row_sum = 0;
  for (int i = first; i < last; ++i) row_sum += pairs[i].ratio;
  for (int i = first; i < last; ++i) {
    GatedPair& pair = pairs[i];
    const double others = column_sum_[at(pair.detection)] - pair.ratio;
    pair.weight = pair.ratio / (row_sum + std::max(others, 0.0) + missed[target]);
  }
}

void JointAssociation::fill_cluster(const double* missed, const GatedPair* pairs) {
  rows_ = static_cast<int>(members_.size());
  columns_ = 0;
  for (int row = 0; row < rows_; ++row) {
    const int t = members_[at(row)];
    // A common factor of a target's options changes nothing, and keeps the products in range.
    double scale = missed[t];
    for (int i = first_pair_[at(t)]; i < first_pair_[at(t) + 1]; ++i) {
      scale = std::max(scale, pairs[i].ratio);
    }
    none_[at(row)] = missed[t] / scale;
    ratio_[at(row)].fill(0);
    for (int i = first_pair_[at(t)]; i < first_pair_[at(t) + 1]; ++i) {
      const int column = column_[at(pairs[i].detection)];
      columns_ = std::max(columns_, column + 1);
      ratio_[at(row)][at(column)] = pairs[i].ratio / scale;
    }
  }
}

void JointAssociation::weigh_exactly(GatedPair* pairs) {
  const std::size_t sets = std::size_t{1} << columns_;
  for (int row = 0; row <= rows_; ++row) {
    std::fill_n(before_[at(row)].begin(), sets, 0.0);
    std::fill_n(after_[at(row)].begin(), sets, row == rows_ ? 1.0 : 0.0);
  }
  before_[0][0] = 1;
  for (int row = 0; row < rows_; ++row) {
    for (std::size_t taken = 0; taken < sets; ++taken) {
      const double weight = before_[at(row)][taken];
      if (weight == 0) continue;
      before_[at(row) + 1][taken] += weight * none_[at(row)];
      for (int c = 0; c < columns_; ++c) {
        const std::size_t bit = std::size_t{1} << c;
        if ((taken & bit) == 0) {
          before_[at(row) + 1][taken | bit] += weight * ratio_[at(row)][at(c)];
        }
      }
    }
  }
  for (int row = rows_ - 1; row >= 0; --row) {
    for (std::size_t taken = 0; taken < sets; ++taken) {
      double weight = after_[at(row) + 1][taken] * none_[at(row)];
      for (int c = 0; c < columns_; ++c) {
        const std::size_t bit = std::size_t{1} << c;
        if ((taken & bit) == 0) {
          weight += ratio_[at(row)][at(c)] * after_[at(row) + 1][taken | bit];
        }
      }
      after_[at(row)][taken] = weight;
    }
  }
  const double total = after_[0][0];
  for (int row = 0; row < rows_; ++row) {
    const int t = members_[at(row)];
    for (int i = first_pair_[at(t)]; i < first_pair_[at(t) + 1]; ++i) {
      const std::size_t column = at(column_[at(pairs[i].detection)]);
      const std::size_t bit = std::size_t{1} << column;
      double weight = 0;
      for (std::size_t taken = 0; taken < sets; ++taken) {
        if ((taken & bit) == 0) {
          weight += before_[at(row)][taken] * after_[at(row) + 1][taken | bit];
        }
      }
      pairs[i].weight = weight * ratio_[at(row)][column] / total;
    }
  }
}

void JointAssociation::pick_nearest(GatedPair* pairs, int count) {
  std::fill(target_taken_.begin(), target_taken_.end(), char{0});
  std::fill(detection_taken_.begin(), detection_taken_.end(), char{0});
  const auto last = order_.begin() + count;
  std::iota(order_.begin(), last, 0);
  std::sort(order_.begin(), last, [&](int a, int b) {
    return pairs[a].ratio != pairs[b].ratio ? pairs[a].ratio > pairs[b].ratio : a < b;
  });
  for (auto i = order_.begin(); i != last; ++i) {
    GatedPair& pair = pairs[*i];
    const bool free = !target_taken_[at(pair.target)] && !detection_taken_[at(pair.detection)];
    pair.weight = free ? 1 : 0;
    if (free) {
      target_taken_[at(pair.target)] = 1;
      detection_taken_[at(pair.detection)] = 1;
    }
  }
}

}  // namespace alidade

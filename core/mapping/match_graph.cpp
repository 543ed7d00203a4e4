#include "core/mapping/match_graph.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "core/model/forest.h"

namespace alidade {
namespace {

// A forest; each tree is a group.
class PictureGroups {
 public:
  explicit PictureGroups(int pictures) : parent_(static_cast<std::size_t>(pictures)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  [[nodiscard]] int root(int i) { return internal::root_of(i, &parent_); }
  void join(int a, int b) {
    const int low = std::min(root(a), root(b));
    const int high = std::max(root(a), root(b));
    parent_[static_cast<std::size_t>(high)] = low;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace

std::vector<std::vector<int>> connected_pictures(int pictures, std::vector<SeenIn> seen,
                                                 int least_common) {
  const auto is_outside = [pictures](const SeenIn& s) {
    return s.first < 0 || s.first >= pictures;
  };
  seen.erase(std::remove_if(seen.begin(), seen.end(), is_outside), seen.end());
  const auto by_landmark = [](const SeenIn& a, const SeenIn& b) {
    return a.second != b.second ? a.second < b.second : a.first < b.first;
  };
  std::sort(seen.begin(), seen.end(), by_landmark);
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());

  // One pair for each landmark and any two pictures that see it.
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t first = 0; first < seen.size();) {
    std::size_t last = first;
    while (last < seen.size() && seen[last].second == seen[first].second) ++last;
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t j = i + 1; j < last; ++j) pairs.emplace_back(seen[i].first, seen[j].first);
    }
    first = last;
  }
  std::sort(pairs.begin(), pairs.end());
  PictureGroups groups(pictures);
  for (std::size_t first = 0; first < pairs.size();) {
    std::size_t last = first;
    while (last < pairs.size() && pairs[last] == pairs[first]) ++last;
    if (static_cast<int>(last - first) >= least_common) {
      groups.join(pairs[first].first, pairs[first].second);
    }
    first = last;
  }

  std::vector<std::vector<int>> of_root(static_cast<std::size_t>(pictures));
  for (int i = 0; i < pictures; ++i) of_root[static_cast<std::size_t>(groups.root(i))].push_back(i);
  std::vector<std::vector<int>> out;
  for (auto& group : of_root) {
    if (!group.empty()) out.push_back(std::move(group));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return out;
}

}  // namespace alidade

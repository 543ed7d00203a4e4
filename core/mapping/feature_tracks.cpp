#include "core/mapping/feature_tracks.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <numeric>

#include "core/model/forest.h"

namespace alidade {
namespace {

// A forest over all features of all pictures. Each root knows the pictures of its tree.
class FeatureForest {
 public:
  explicit FeatureForest(const std::vector<int>& features) {
    int first = 0;
    for (std::size_t i = 0; i < features.size(); ++i) {
      first_.push_back(first);
      for (int k = 0; k < features[i]; ++k) picture_of_.push_back(static_cast<int>(i));
      first += features[i];
    }
    first_.push_back(first);
    parent_.resize(picture_of_.size());
    std::iota(parent_.begin(), parent_.end(), 0);
    for (const int picture : picture_of_) pictures_.push_back({picture});
  }

  // -1 if there is none.
  [[nodiscard]] int node(const PictureFeature& f) const {
    if (f.picture < 0 || f.picture + 1 >= static_cast<int>(first_.size()) || f.feature < 0) {
      return -1;
    }
    const auto at = static_cast<std::size_t>(f.picture);
    const int node = first_[at] + f.feature;
    return node < first_[at + 1] ? node : -1;
  }
  [[nodiscard]] PictureFeature feature(int node) const {
    const int picture = picture_of_[static_cast<std::size_t>(node)];
    return {picture, node - first_[static_cast<std::size_t>(picture)]};
  }
  [[nodiscard]] int nodes() const { return static_cast<int>(parent_.size()); }

  [[nodiscard]] int root(int i) { return internal::root_of(i, &parent_); }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    auto& of_a = pictures_[static_cast<std::size_t>(a)];
    auto& of_b = pictures_[static_cast<std::size_t>(b)];
    std::vector<int> all;
    std::merge(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(all));
    if (std::adjacent_find(all.begin(), all.end()) != all.end()) return;
    of_a = std::move(all);
    of_b = {};
    parent_[static_cast<std::size_t>(b)] = a;
  }

 private:
  std::vector<int> first_;       // node of each picture's first feature
  std::vector<int> picture_of_;  // of each node
  std::vector<int> parent_;
  std::vector<std::vector<int>> pictures_;  // of each root, increasing
};

}  // namespace

std::vector<std::vector<PictureFeature>> feature_tracks(const std::vector<int>& features,
                                                        std::vector<TrackMatch> matches) {
  FeatureForest forest(features);
  std::stable_sort(matches.begin(), matches.end(),
                   [](const TrackMatch& a, const TrackMatch& b) { return a.doubt < b.doubt; });
  for (const TrackMatch& match : matches) {
    const int a = forest.node(match.a);
    const int b = forest.node(match.b);
    if (a >= 0 && b >= 0) forest.join(a, b);
  }
  std::vector<std::vector<PictureFeature>> of_root(static_cast<std::size_t>(forest.nodes()));
  for (int i = 0; i < forest.nodes(); ++i) {
    of_root[static_cast<std::size_t>(forest.root(i))].push_back(forest.feature(i));
  }
  std::vector<std::vector<PictureFeature>> out;
  for (auto& track : of_root) {
    if (track.size() > 1) out.push_back(std::move(track));
  }
  return out;
}

}  // namespace alidade

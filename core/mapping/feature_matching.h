#pragma once
// Which feature of one set is which of another: FLANN's k-d trees over 8-bit descriptors (Muja, Lowe 2009), and Lowe's ratio test:
// the nearest is believed if the second nearest is much further, which says that nothing else looks like it.
// Repeated texture fails that test, and what passes by chance has to fit a pose (picture_pose.h). Of features that claim the same
// one the nearest keeps it. Equal input gives equal matches. Batch work: allocates.

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "core/mapping/features.h"

namespace alidade {

struct MatchOptions {
  double ratio =
      0.8;  // of the distances to nearest and second nearest, above which nothing is believed
  int checks = 64;  // leaves of the trees that are looked at for each
};

struct FeatureMatch {
  int query = 0;
  int indexed = 0;
  double ratio = 0;  // of distances; the smaller the surer
};

// The nearest of a feature, by increasing distance; where there are fewer, indexed is -1.
struct NearFeature {
  int indexed = -1;
  float square = std::numeric_limits<float>::infinity();  // of the distance
};
inline constexpr int kNearFeatures = 4;
using NearFeatures = std::array<NearFeature, kNearFeatures>;

// By looking at all: exact, and for some thousands faster than trees.
[[nodiscard]] std::vector<NearFeatures> nearest_features(const std::vector<Descriptor>& queries,
                                                         const std::vector<Descriptor>& indexed);

// The ratio test on them. is_same(a, b): whether two of the indexed are one thing that stands there more than once, of which the
// next is no rival; empty: none are. In increasing order of query, each of the indexed at most once.
[[nodiscard]] std::vector<FeatureMatch> believed_matches(
    const std::vector<NearFeatures>& near, double ratio,
    const std::function<bool(int, int)>& is_same = {});

// Descriptors prepared for being searched; keeps a copy of them.
class FeatureIndex {
 public:
  explicit FeatureIndex(const std::vector<Descriptor>& descriptors);
  ~FeatureIndex();
  FeatureIndex(FeatureIndex&&) noexcept;
  FeatureIndex& operator=(FeatureIndex&&) noexcept;

  [[nodiscard]] std::size_t size() const;

  // In increasing order of query. Fewer than two descriptors on the index's side match nothing: there is no ratio.
  [[nodiscard]] std::vector<FeatureMatch> match(const std::vector<Descriptor>& queries,
                                                const MatchOptions& options = {}) const;

  // As nearest_features(), but for what the trees miss.
  [[nodiscard]] std::vector<NearFeatures> nearest(const std::vector<Descriptor>& queries,
                                                  int checks) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade

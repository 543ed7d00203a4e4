#pragma once
// Matches features of two sets: k-d trees of FLANN over 8-bit descriptors (Muja, Lowe 2009) and
// Lowe's ratio test. The nearest descriptor is accepted if the second nearest is much farther, so
// that nothing else looks like it. Repeated texture fails this test; a match that passes by chance
// is rejected later, as it fits no pose (picture_pose.h). If several features match the same one,
// the nearest keeps it. Equal input gives equal matches. Batch work: allocates.

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "core/mapping/features.h"

namespace alidade {

struct MatchOptions {
  // Largest accepted ratio, nearest distance over second nearest; 0 to 1.
  double ratio = 0.8;
  int checks = 64;  // leaves of the trees that are searched for each feature
};

struct FeatureMatch {
  int query = 0;     // index of a feature that was searched for
  int indexed = 0;   // index of the feature that was found
  double ratio = 0;  // of distances; smaller is surer
};

struct NearFeature {
  int indexed = -1;                                       // -1: there is none
  float square = std::numeric_limits<float>::infinity();  // squared distance of the descriptors
};
// The nearest features, by increasing distance.
inline constexpr int kNearFeatures = 4;
using NearFeatures = std::array<NearFeature, kNearFeatures>;

// One result for each query. Compares with all descriptors: exact, and for some thousands of them
// faster than trees.
[[nodiscard]] std::vector<NearFeatures> nearest_features(const std::vector<Descriptor>& queries,
                                                         const std::vector<Descriptor>& indexed);

// The ratio test. near: by query; one with fewer than two near features has no match. ratio: as
// MatchOptions::ratio. is_same(a, b): whether two indexed features show the same thing; if so, the
// second nearest is not a rival. An empty function: no two do. Returns matches in increasing order
// of query, each indexed feature at most once.
[[nodiscard]] std::vector<FeatureMatch> believed_matches(
    const std::vector<NearFeatures>& near, double ratio,
    const std::function<bool(int, int)>& is_same = {});

// Descriptors prepared for a search; keeps a copy of them.
class FeatureIndex {
 public:
  explicit FeatureIndex(const std::vector<Descriptor>& descriptors);
  ~FeatureIndex();
  FeatureIndex(FeatureIndex&&) noexcept;
  FeatureIndex& operator=(FeatureIndex&&) noexcept;

  [[nodiscard]] std::size_t size() const;

  // Matches in increasing order of query. An index of fewer than two descriptors matches nothing,
  // as there is no ratio.
  [[nodiscard]] std::vector<FeatureMatch> match(const std::vector<Descriptor>& queries,
                                                const MatchOptions& options = {}) const;

  // The same as nearest_features() of the index, except for neighbours that the trees miss. An
  // index of fewer than two descriptors finds nothing. checks: as MatchOptions::checks.
  [[nodiscard]] std::vector<NearFeatures> nearest(const std::vector<Descriptor>& queries,
                                                  int checks) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade

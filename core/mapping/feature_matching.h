#pragma once
// Which feature of one set is which of another: FLANN's k-d trees over 8-bit descriptors (Muja, Lowe 2009), and Lowe's ratio test:
// the nearest is believed if the second nearest is much further, which says that nothing else looks like it.
// Repeated texture fails that test, and what passes by chance has to fit a pose (picture_pose.h). Of features that claim the same
// one the nearest keeps it. Equal input gives equal matches. Batch work: allocates.

#include <cstddef>
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

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade

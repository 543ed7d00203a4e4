#pragma once
// JointAssociation: weights beta(t, j) that detection j belongs to target t, from r and m:
//   r(t, j) = P_D N(z_j; expected, S) / lambda    t against a false alarm; 0 outside t's gate
//   m(t) = 1 - P_D P_G                            t is missed, or outside its gate
// An event pairs targets and detections one to one; its weight is the product of r of the pairs and
// m of the other targets. lambda: density of false alarms, per unit of measured area. A cluster is
// a set of targets and detections that shared detections connect. Fixed memory after construction;
// no allocation. Equal input gives equal weights. Details: docs/derivations.md.

#include <array>
#include <vector>

namespace alidade {

// kExact: the weight of the events in which t has j, over the weight of all events (Fortmann,
// Bar-Shalom, Scheffe 1983); in clusters of more than kLargestExactCluster targets or detections
// kCheap is used.
// kCheap: r / (row sum + column sum - r + m) (Fitzgerald 1986; Lisanti et al.'s [27]); PDA if no
// targets share detections.
// kNearest: 1 for the pair with the largest r, then for the largest r of the targets and detections
// that are left; the others 0. The baseline.
enum class AssociationMethod { kExact, kCheap, kNearest };

// A detection within a target's gate.
struct GatedPair {
  int target = 0;     // index
  int detection = 0;  // index
  double ratio = 0;   // r
  double weight = 0;  // beta, the result
};

class JointAssociation {
 public:
  static constexpr int kLargestExactCluster = 6;

  JointAssociation(int max_targets, int max_detections);

  // targets: at most max_targets. pairs: ordered by target, each pair once, indices below `targets`
  // and max_detections, ratios >= 0. missed[t] in (0, 1]: m of target t. Fills in the weights. 1
  // minus the sum of a target's weights is the probability that it has none of the detections.
  void weigh(AssociationMethod method, const double* missed, int targets, GatedPair* pairs,
             int count);

  // Clusters of the last call: those weighed exactly, and those too large for it. Both are 0 unless
  // it was with kExact.
  [[nodiscard]] int exact_clusters() const { return exact_clusters_; }
  [[nodiscard]] int cheap_clusters() const { return cheap_clusters_; }

 private:
  [[nodiscard]] int root_of(int target);
  void find_clusters(int targets, const GatedPair* pairs, int count);
  void weigh_cheaply(const double* missed, int target, GatedPair* pairs);
  void fill_cluster(const double* missed, const GatedPair* pairs);
  void weigh_exactly(GatedPair* pairs);
  void pick_nearest(GatedPair* pairs, int count);

  std::vector<int> parent_;      // of each target, towards its cluster's root
  std::vector<int> holder_;      // of each detection: a target with it in its gate, or -1
  std::vector<int> first_pair_;  // of each target, and one more
  std::vector<int> column_;      // of each detection in the current cluster, or -1
  std::vector<int> order_;       // of pairs
  std::vector<double> column_sum_;
  std::vector<char> done_, target_taken_, detection_taken_;
  std::vector<int> members_;  // targets of the current cluster
  // The current cluster; each row is divided by its largest number.
  int rows_ = 0, columns_ = 0;
  std::array<std::array<double, kLargestExactCluster>, kLargestExactCluster> ratio_{};
  std::array<double, kLargestExactCluster> none_{};
  // Weight of all ways in which the targets before this one, or from it on, take exactly, or avoid,
  // a set of detections.
  std::array<std::array<double, 1 << kLargestExactCluster>, kLargestExactCluster + 1> before_{};
  std::array<std::array<double, 1 << kLargestExactCluster>, kLargestExactCluster + 1> after_{};
  int exact_clusters_ = 0;
  int cheap_clusters_ = 0;
};

}  // namespace alidade

#pragma once
// Which detection belongs to which target: weights beta(t, j) of target t and detection j, from
//   r(t, j)  P_D N(z_j; expected, S) / lambda: how much better t explains j than a false alarm does, 0 outside t's gate; lambda is the density
//            of false alarms
//   m(t)     1 - P_D P_G: how likely t goes undetected, or outside its gate
// In an event each target has at most one detection and each detection at most one target; its weight is the product of r of what is paired
// and m of the targets that are not.
//   kExact    beta = share of all events' weight in which t has j (Fortmann, Bar-Shalom, Scheffe 1983). Summed by sets of taken detections
//             instead of event by event: 2^detections times targets sums for each cluster
//   kCheap    beta = r / (row sum + column sum - r + m) (Fitzgerald 1986; Lisanti et al.'s [27]): PDA if no target shares
//   kNearest  1 for the pair with the greatest r, then among what is left: the baseline
// A cluster is what shared detections tie together. kExact takes those of at most kLargestExactCluster targets and detections, and kCheap for others.
// Fixed memory after construction, no allocation; equal input, equal weights.

#include <array>
#include <vector>

namespace alidade {

enum class AssociationMethod { kExact, kCheap, kNearest };

// A detection within the gate of a target.
struct GatedPair {
  int target = 0;
  int detection = 0;
  double ratio = 0;   // r
  double weight = 0;  // beta, the answer
};

class JointAssociation {
 public:
  static constexpr int kLargestExactCluster = 6;

  JointAssociation(int max_targets, int max_detections);

  // pairs: ordered by target, each pair once, targets and detections below the capacities; missed[t] in (0, 1] is m of target t.
  // Fills in the weights. What a target's weights leave of 1 is how likely it has none of them.
  void weigh(AssociationMethod method, const double* missed, int targets, GatedPair* pairs,
             int count);

  // Of the last call with kExact: how many clusters were weighed so, and how many were too large.
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
  std::vector<int> holder_;      // of each detection: a target that has it in its gate, or -1
  std::vector<int> first_pair_;  // of each target, and one more
  std::vector<int> column_;      // of each detection in the cluster at hand, or -1
  std::vector<int> order_;       // of pairs
  std::vector<double> column_sum_;
  std::vector<char> done_, target_taken_, detection_taken_;
  std::vector<int> members_;  // targets of the cluster at hand
  // The cluster at hand, each row by its greatest number.
  int rows_ = 0, columns_ = 0;
  std::array<std::array<double, kLargestExactCluster>, kLargestExactCluster> ratio_{};
  std::array<double, kLargestExactCluster> none_{};
  // Weight of all ways in which the targets before this one, or from it on, take just, or avoid, a set of detections.
  std::array<std::array<double, 1 << kLargestExactCluster>, kLargestExactCluster + 1> before_{};
  std::array<std::array<double, 1 << kLargestExactCluster>, kLargestExactCluster + 1> after_{};
  int exact_clusters_ = 0;
  int cheap_clusters_ = 0;
};

}  // namespace alidade

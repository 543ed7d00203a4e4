#pragma once
// ZoomEvidence: what calibrations say of the nodes of a zoom curve and of what these share, without the curves' own smoothness: the
// information H and g = H times its mean of all unknowns, node by node the quantities less their level, then the shared
// parameters as changes from a reference. Priors of shared parameters are in it once, those of a node's quantities not at all.
// A fitted curve is taken apart into the same: its covariance's inverse less the smoothness that went into it. Allocates.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/zoom_sample.h"

namespace alidade::internal {

struct ZoomEvidence {
  std::vector<double> reading;   // of the nodes, not decreasing
  std::vector<bool> is_between;  // of them: as ZoomCurve::Content
  std::array<double, kZoomQuantityCount> level{};
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  // What is known of each quantity of all nodes together, less the level, the others open, with centres that are as good as usual:
  // tells how rough the curves are. Errors that nodes have in common, such as those of the axes in the centres, are in it.
  std::array<Eigen::MatrixXd, kZoomQuantityCount> information;
  std::array<Eigen::VectorXd, kZoomQuantityCount> weighted;  // times the mean

  [[nodiscard]] int nodes() const { return static_cast<int>(reading.size()); }
  // Row of H, by a sample's place.
  [[nodiscard]] int row(int node, int place) const {
    return place < kZoomQuantityCount ? kZoomQuantityCount * node + place
                                      : kZoomQuantityCount * nodes() + place - kZoomQuantityCount;
  }
  // Of these places of all nodes, and of what is shared.
  [[nodiscard]] std::vector<int> rows(const std::vector<int>& places) const;
};

// Of readings in order, nothing known of them.
[[nodiscard]] ZoomEvidence no_zoom_evidence(const std::vector<double>& readings);
void add_zoom_sample(const ZoomSample& sample, int node, bool with_shared_priors,
                     ZoomEvidence* evidence);

struct ZoomCurveParts {
  double common_clock_sigma_s = 0;  // in the curve's clock offset, see ZoomFitOptions
  bool clock_is_another = false;
  std::vector<int> places;  // of a sample that are not exact
};
// False: the covariance is not positive.
[[nodiscard]] bool take_apart(const ZoomCurve& curve, const ZoomCurveParts& parts,
                              ZoomEvidence* evidence);
// Room for one more node; returns where.
int insert_node(double reading, ZoomEvidence* evidence);
// information and weighted from H and g; centre_sigma_px: how good a centre is, usually. False: H is not positive.
[[nodiscard]] bool set_marginals(const std::vector<int>& places, double centre_sigma_px,
                                 ZoomEvidence* evidence);

// Without one node, whose part in the others' values remains: one between two that are the closest together.
[[nodiscard]] ZoomCurve::Content without_a_node(const ZoomCurve::Content& content);

}  // namespace alidade::internal

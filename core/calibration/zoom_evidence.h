#pragma once
// ZoomEvidence: what calibrations say about the nodes of a zoom curve and about what these share,
// without the curves' own smoothness. It is the information H and g = H times the mean. Unknowns:
// node by node the quantities minus their level, then the shared parameters as changes from a
// reference.
// H contains the priors of shared parameters once, and none of a node's quantities.
// take_apart() converts a fitted curve back: the inverse of its covariance minus the smoothness
// that went into it. Allocates.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/zoom_sample.h"

namespace alidade::internal {

struct ZoomEvidence {
  std::vector<double> reading;   // of the nodes, not decreasing
  std::vector<bool> is_between;  // of the nodes: as ZoomCurve::Content
  std::array<double, kZoomQuantityCount> level{};
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  // Marginal information of each quantity at all nodes (minus its level), all other unknowns free,
  // with centres of the usual uncertainty. It determines the roughness of the curves. It includes
  // errors that nodes share, such as the axes' errors in the centres.
  std::array<Eigen::MatrixXd, kZoomQuantityCount> information;
  std::array<Eigen::VectorXd, kZoomQuantityCount> weighted;  // information times the mean

  [[nodiscard]] int nodes() const { return static_cast<int>(reading.size()); }
  // Row of H of an index in a sample.
  [[nodiscard]] int row(int node, int place) const {
    return place < kZoomQuantityCount ? kZoomQuantityCount * node + place
                                      : kZoomQuantityCount * nodes() + place - kZoomQuantityCount;
  }
  // Rows of these sample indices: at all nodes, and of what is shared.
  [[nodiscard]] std::vector<int> rows(const std::vector<int>& places) const;
};

// Evidence without information at these ordered readings.
[[nodiscard]] ZoomEvidence no_zoom_evidence(const std::vector<double>& readings);
void add_zoom_sample(const ZoomSample& sample, int node, bool with_shared_priors,
                     ZoomEvidence* evidence);

struct ZoomCurveParts {
  double common_clock_sigma_s = 0;  // s; in the curve's clock offset, see ZoomFitOptions
  bool clock_is_another = false;
  std::vector<int> places;  // sample indices that are not exact
};
// False: the covariance is not positive.
[[nodiscard]] bool take_apart(const ZoomCurve& curve, const ZoomCurveParts& parts,
                              ZoomEvidence* evidence);
// Makes room for one more node and returns its index.
int insert_node(double reading, ZoomEvidence* evidence);
// Computes information and weighted from H and g. centre_sigma_px: usual uncertainty of a centre.
// False: H is not positive.
[[nodiscard]] bool set_marginals(const std::vector<int>& places, double centre_sigma_px,
                                 ZoomEvidence* evidence);

// Removes one node: the inner one whose neighbours are closest together. What it contributed to the
// other nodes stays.
[[nodiscard]] ZoomCurve::Content without_a_node(const ZoomCurve::Content& content);

}  // namespace alidade::internal

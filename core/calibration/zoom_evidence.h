#pragma once
// ZoomEvidence: what calibrations say about the nodes of a zoom curve and about the parameters that
// all nodes share, without the smoothness of the curves. It is the information H, and g = H times
// the mean.
// Unknowns: for each node the quantities minus their level, then the shared parameters as changes
// from a reference calibration. H contains the priors of shared parameters once, and no priors of
// the quantities. take_apart() converts a fitted curve back: the inverse of its covariance, minus
// the information of the smoothness. Units of ZoomQuantity and Parameter. Allocates.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/zoom_sample.h"

namespace alidade::internal {

struct ZoomEvidence {
  std::vector<double> reading;   // of each node, device units, not decreasing
  std::vector<bool> is_between;  // of each node: seen in a movement of the zoom, not in a dwell
  std::array<double, kZoomQuantityCount> level{};  // subtracted from a quantity, in its unit
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  // For each quantity the marginal information on its values at all nodes (minus its level), with
  // all other unknowns free and the centres' usual uncertainty as their prior. The roughness of the
  // curves follows from it. It includes errors that nodes share, such as those that the axes' error
  // makes in the centres. Set by set_marginals().
  std::array<Eigen::MatrixXd, kZoomQuantityCount> information;
  std::array<Eigen::VectorXd, kZoomQuantityCount> weighted;  // information times the mean

  [[nodiscard]] int nodes() const { return static_cast<int>(reading.size()); }
  // The row of H for a node and an index in a sample. For a shared parameter any node will do.
  [[nodiscard]] int row(int node, int place) const {
    return place < kZoomQuantityCount ? kZoomQuantityCount * node + place
                                      : kZoomQuantityCount * nodes() + place - kZoomQuantityCount;
  }
  // The rows of H for these sample indices, increasing: a quantity's at each node, a shared
  // parameter's once.
  [[nodiscard]] std::vector<int> rows(const std::vector<int>& places) const;
};

// A node at each of these readings (not decreasing), with zero information.
[[nodiscard]] ZoomEvidence no_zoom_evidence(const std::vector<double>& readings);
// sample: its information is set (set_zoom_information()). with_shared_priors: the priors of shared
// parameters stay in it, which is right for one sample only.
void add_zoom_sample(const ZoomSample& sample, int node, bool with_shared_priors,
                     ZoomEvidence* evidence);

struct ZoomCurveParts {
  double common_clock_sigma_s = 0;  // part of the curve's clock offset, see ZoomFitOptions
  // The curve's clock offset is of another connection: its variance grows by kAnyConnection_s^2.
  bool clock_is_another = false;
  std::vector<int> places;  // sample indices that are not exact
};
// Sets *evidence without its marginals. False: the curve's covariance is not positive definite over
// the places.
[[nodiscard]] bool take_apart(const ZoomCurve& curve, const ZoomCurveParts& parts,
                              ZoomEvidence* evidence);
// Adds a node without information, after the nodes of equal reading, and returns its index. The
// marginals must be set anew.
int insert_node(double reading, ZoomEvidence* evidence);
// Computes information and weighted from H and g. centre_sigma_px: usual uncertainty of a centre;
// 0: none is added. False: H is not positive definite.
[[nodiscard]] bool set_marginals(const std::vector<int>& places, double centre_sigma_px,
                                 ZoomEvidence* evidence);

// Removes one node: the inner one whose neighbours are closest together. Its contribution to the
// other nodes stays. content: three nodes or more. Content::inverse must be set anew.
[[nodiscard]] ZoomCurve::Content without_a_node(const ZoomCurve::Content& content);

}  // namespace alidade::internal

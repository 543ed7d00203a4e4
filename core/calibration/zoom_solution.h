#pragma once
// ZoomSolution: least squares over the evidence of calibrations about a zoom's nodes, with the
// curves as prior (steps 2 and 3 of zoom_fit.h). It chooses the roughness by likelihood, then
// solves for nodes, shared parameters and their covariance. Allocates.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/calibration/zoom_evidence.h"
#include "core/calibration/zoom_fit.h"

namespace alidade::internal {

class ZoomSolution {
 public:
  // places: sample indices that are not exact. reference: the shared parameters are changes from
  // it. reference and options must outlive this object, and must not change.
  ZoomSolution(ZoomEvidence evidence, std::vector<int> places, const Calibration& reference,
               const ZoomFitOptions& options);

  // False and one line in *error: something is undetermined.
  [[nodiscard]] bool run(std::string* error);
  // The same with the smoothness of a curve that was taken apart for the evidence. With it, what
  // rounding did to the evidence cancels.
  [[nodiscard]] bool run_as(const ZoomCurve::Content& before, std::string* error);

  // After run(): the residual of a sample at a node against the solution.
  [[nodiscard]] ZoomSampleVector left_of(const ZoomSample& sample, int node) const;
  // The number of shared parameters among `places`.
  [[nodiscard]] int shared_places() const;
  // After run(). False and one line in *error: the focal length is not monotone in the reading.
  [[nodiscard]] bool curve(ZoomCurve* curve, std::string* error) const;

 private:
  void set_nodes();
  void choose_roughness();
  [[nodiscard]] bool solve();
  void take_shared(const Eigen::Matrix<double, kSharedCount, 1>& change);

  ZoomEvidence evidence_;
  std::vector<int> places_;
  const Calibration& reference_;
  const ZoomFitOptions& options_;
  int nodes_;
  ZoomCurve::Content content_;
  Eigen::VectorXd solution_;
};

}  // namespace alidade::internal

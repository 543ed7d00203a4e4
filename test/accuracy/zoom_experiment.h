#pragma once
// How accurate and how honest a zoom curve is that comes of one recording with dwells at some zooms: each dwell calibrated,
// all fitted (core/calibration/zoom_fit.h), held against the virtual camera's own lens.
//   f at 40 other readings, after a movement: error over sigma, within 3 of them in 39 of 40; beside it the nearest node's f
//   log f, corner distortion and both coordinates of the optical centre at the nodes: e^T P^-1 e over all nodes of a run, with
//   their joint covariance, is chi-square with as many degrees of freedom, whatever the errors have in common
//   pan and tilt axis likewise, four degrees of freedom
// and all of it again with the image's middle taken as the optical centre.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "test/accuracy/zoom_recording.h"

namespace alidade::test {

struct ZoomExperimentOptions {
  ZoomScenario scenario;
  int runs = 10;
  std::uint64_t first_seed = 1;
  bool movements = true;  // of the zoom, too
  double zoom_late_sigma_s = ZoomFitOptions().zoom_late_sigma_s;
};

// Prints tables; what lies where an honest estimator's would not in one experiment of a hundred.
[[nodiscard]] std::vector<std::string> run_zoom_experiment(const ZoomExperimentOptions& options,
                                                           std::ostream& out);

}  // namespace alidade::test

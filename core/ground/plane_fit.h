#pragma once
// The ground plane from whatever is known (plane_evidence.h): least squares, covariance, how each datum fits, and a refusal with its
// reason where it is not determined or a datum is grossly wrong.
//   covariance   of (xi, p), first order, larger by chi-square per degree of freedom where that is beyond chance (1 in 1000)
//   misfit       of one datum: sqrt(r^T Q^+ r / size), Q the covariance of its residual r after the fit (Baarda's data snooping): 1 is
//                what its sigmas say; none where nothing else checks it
// A misfit beyond the gate ends in kMisfit, which names the datum without which the others agree best. What is free is told by the
// weakest direction of the information, in words. Where data fit either way up, as points of the horizon do, the base is taken to
// stand upright: its down axis below the horizontal. Allocates; a few milliseconds.

#include <optional>
#include <string>
#include <vector>

#include "core/ground/plane_evidence.h"
#include "core/ground/world_plane.h"

namespace alidade {

struct PlaneFitOptions {
  double gate_sigmas = 5;           // of a misfit
  double most_tilt_sigma = 0.1;     // rad: beyond it the plane is not determined
  double most_heading_sigma = 0.2;  // rad
  double most_height_share = 0.2;   // sigma of the height over the height

  [[nodiscard]] bool validate(const char** error) const;
};

enum class PlaneFitStatus {
  kOk,
  kBadInput,       // a sigma that is not above 0, a direction of no unit length, ...
  kNoScale,        // nothing says how large anything is
  kUndetermined,   // see message
  kCameraOnPlane,  // the plane goes through the camera
  kAmbiguous,      // two places of the camera fit alike
  kMisfit,         // one datum is grossly wrong: worst
  kNoSolution      // no plane on which all data mean something
};

[[nodiscard]] const char* to_string(PlaneFitStatus status);

struct DatumFit {
  std::optional<double> misfit;  // standardised; 1 is expected
  double checked = 0;            // 0 to 1: how far the other data say it, too
};

// plane, data and statistics with kOk, kMisfit, and kUndetermined if something is known.
struct PlaneFit {
  PlaneFitStatus status = PlaneFitStatus::kBadInput;
  std::string message;  // of a refusal: why, and what would help
  WorldPlane plane;
  std::vector<DatumFit> data;  // in the order of the evidence
  int worst = -1;              // of the data, with kMisfit
  double chi_square = 0;
  int degrees_of_freedom = 0;
  double noise_scale = 1;  // sqrt(chi-square per degree of freedom); 1 where there is none
  bool origin_below_camera =
      false;                     // x and y of w are the camera's: nothing tied them to the ground
  bool heading_of_base = false;  // Y of w lies below the base's forward direction, likewise
};

[[nodiscard]] PlaneFit fit_plane(const PlaneEvidence& evidence,
                                 const PlaneFitOptions& options = {});

}  // namespace alidade

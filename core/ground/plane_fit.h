#pragma once
// fit_plane(): the ground plane from any mix of data (plane_evidence.h) by least squares, with
// covariance and each datum's misfit; or a refusal with its reason. Allocates; some milliseconds.
// The covariance of (xi, p) is first order. It is multiplied by chi-square per degree of freedom if
// this exceeds 1 beyond chance (1 in 1000). A misfit is sqrt(r^T Q^+ r / rank), Q the covariance of
// the residual r after the fit (Baarda's data snooping); 1 is expected. With kMisfit, `worst` is
// the datum without which the others agree best, among the eight with the largest r^T Q^+ r. If the
// data fit with both sides up, as points of the horizon do, the base's down axis is taken to point
// below the horizontal.

#include <optional>
#include <string>
#include <vector>

#include "core/ground/plane_evidence.h"
#include "core/ground/world_plane.h"

namespace alidade {

struct PlaneFitOptions {
  double gate_sigmas = 5;           // largest sqrt(r^T Q^+ r) of a datum; beyond it kMisfit
  double most_tilt_sigma = 0.1;     // rad; beyond this and the next two, kUndetermined
  double most_heading_sigma = 0.2;  // rad; does not count with heading_of_base
  double most_height_share = 0.2;   // sigma of the height over the height

  // False if a limit is not above 0. *error then says so in one line; error must not be null.
  [[nodiscard]] bool validate(const char** error) const;
};

enum class PlaneFitStatus {
  kOk,
  kBadInput,       // such as a sigma or length not > 0, a direction not of unit length, bad options
  kNoScale,        // nothing gives a length
  kUndetermined,   // see message
  kCameraOnPlane,  // the plane goes through the camera
  kAmbiguous,      // another plane fits about as well
  kMisfit,         // a datum is grossly wrong: see worst
  kNoSolution      // no plane on which all data are defined
};

[[nodiscard]] const char* to_string(PlaneFitStatus status);

struct DatumFit {
  std::optional<double> misfit;  // 1 is expected; empty: no other data check it
  double checked = 0;            // 0 to 1; how far the other data determine the same quantity
};

// plane, data and statistics with kOk and kMisfit.
struct PlaneFit {
  PlaneFitStatus status = PlaneFitStatus::kBadInput;
  std::string message;  // of a refusal: why, and what would help
  WorldPlane plane;
  std::vector<DatumFit> data;  // in the order of the evidence
  int worst = -1;              // index of the datum, with kMisfit
  double chi_square = 0;
  int degrees_of_freedom = 0;
  double noise_scale = 1;  // sqrt(chi-square per degree of freedom); 1: no degree of freedom
  // The origin of w is below the camera, as no data tie the camera's place to the ground.
  bool origin_below_camera = false;
  // Y of w is below the base's forward direction, as no data give a heading.
  bool heading_of_base = false;
};

[[nodiscard]] PlaneFit fit_plane(const PlaneEvidence& evidence,
                                 const PlaneFitOptions& options = {});

}  // namespace alidade

#pragma once
// Bundle adjustment of a map: all pictures, at all zooms, and one lens.
//   picture i    R_i = R_base_from_camera when its reference row is exposed, eps_i; log f_i = s_i + delta(s_i) + eps_i (lens_curve.h)
//   landmark j   direction d_j, unit length, base: two unknowns
//   least        sum rho(|u_ij - project(R_i, lens(s_i, eps_i), d_j)|^2 / sigma_ij^2)        over what was seen (map_projection.h)
//                + |Log(Rp_i^T R_i)|^2 by cov_p     where there is telemetry: Rp what it says, its backlash in cov_p
//                + (eps_i / sigma_eps_i)^2 + the lens's own priors, one of them of its hold
// rho is Huber's. What lies off by more than the gate is left out, and the rest adjusted again. By Ceres; landmarks are eliminated
// first (Schur), and the covariance of the pictures is that of the reduced normal matrix, inflated where residuals are larger than
// claimed. Rotations and directions are differences to their start values, exactly. The pictures have to hang together: without
// that, what does not is named. Without any telemetry the first picture's orientation is kept.
// Pictures are taken to be slow: an error of v does not move the row's time here. Equal input gives equal results on one thread.
// Allocates: the covariance takes the square of (4 pictures + the lens) numbers.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/mapping/map_projection.h"

namespace alidade {

struct OrientationPrior {
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  Matrix3<double> covariance =
      Matrix3<double>::Identity();  // of xi in R Exp(xi), rad^2; positive definite
};

struct MapPicture {
  double position = 0;  // s of the lens curve: log f by the zoom reading
  double eps_sigma =
      1e-3;  // of log f beside the curve: the zoom's repeatability, or what is not known of s; above 0
  PictureMotion motion;
  Matrix3<double> R_start = Matrix3<double>::Identity();  // R_base_from_camera to begin with
  std::optional<OrientationPrior> telemetry;
};

struct MapObservation {
  int picture = 0;
  int landmark = 0;
  Vector2<double> u;      // px
  double sigma_px = 0.2;  // of each coordinate; above 0
};

struct MapEvidence {
  std::vector<MapPicture> pictures;
  int landmarks = 0;
  std::vector<MapObservation> observations;
};

struct MapOptions {
  LensCurve lens;  // as it is thought of; its range has to hold all positions
  std::optional<LensCurve>
      start;  // the adjustment begins here, of the same knots; none: with the lens above
  // Sigmas of a control point's delta, kappa, c_u, c_v about the beginning, and of second differences of neighbouring ones.
  LensQuantities level_sigma{0.05, 0.1, 30, 30};
  LensQuantities bend_sigma{0.02, 0.02, 3, 3};
  double hold_sigma = 0.5;  // of the lens's hold about the beginning
  double most_start_error =
      0.1;                 // rad, of a direction that orientation and lens give to begin with
  double gate_sigmas = 4;  // times the noise that was found
  int least_common = 8;    // landmarks that two pictures need in common to hang together
  int max_steps = 100;     // of each adjustment
  int threads = 1;
};

enum class MapStatus {
  kOk,
  kBadInput,       // indices or numbers out of range; no picture
  kNotConnected,   // see groups
  kNotDetermined,  // singular
  kNotConverged,
};

[[nodiscard]] const char* to_string(MapStatus status);

struct AdjustedPicture {
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  double eps = 0;
  Camera<double> camera;
};

// All but status and groups only with kOk.
struct MapAdjustment {
  MapStatus status = MapStatus::kBadInput;
  std::vector<std::vector<int>>
      groups;  // of pictures that hang together, the largest first; one, with kOk
  std::vector<AdjustedPicture> pictures;
  LensCurve lens;
  std::vector<Vector3<double>>
      landmarks;               // base; of zero length where less than two observations are left
  std::vector<int> left_out;   // observations, increasing
  Eigen::MatrixXd covariance;  // (xi, log f) of each picture, 4 rows each
  double hold_sigma = 0;       // of the lens's hold
  double noise_scale = 0;      // root mean square of the residuals in their sigmas
  int steps = 0;

  [[nodiscard]] Matrix4<double> covariance_of(int picture) const {
    return covariance.block<4, 4>(4 * picture, 4 * picture);
  }
};

[[nodiscard]] MapAdjustment adjust_map(const MapEvidence& evidence, const MapOptions& options);

}  // namespace alidade

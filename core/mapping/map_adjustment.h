#pragma once
// adjust_map(): bundle adjustment of all pictures of a map, at all zooms, with one lens. Unknowns:
// R_i at the reference row, motion m_i and eps_i of picture i, direction d_j of landmark j, lens
// (lens_curve.h).
//   sum rho(|u_ij - project(R_i, lens(s_i, eps_i), d_j)|^2 / sigma_ij^2)             rho: Huber's
// + |Log(Rp_i^T R_i)|^2 by cov_p, with telemetry Rp  + (eps_i / sigma_eps_i)^2 + priors of the lens
// + ((m_i - telemetry's) / sigma_m_i)^2: rates with noise, taken as exact, would shorten all f, as
//   the read-out of a moving picture shows f times the rate
// All pictures must be connected by landmarks, else the result names the groups. If no picture has
// telemetry, the first picture's orientation is kept. Equal input gives equal results on one
// thread. Allocates (4 pictures + lens)^2 numbers of covariance. Method: docs/derivations.md.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/mapping/picture_motion.h"

namespace alidade {

struct OrientationPrior {
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  // Covariance of xi in R Exp(xi), rad^2; positive definite.
  Matrix3<double> covariance = Matrix3<double>::Identity();
};

struct MapPicture {
  double position = 0;  // s of the lens curve: log f by the zoom reading
  // Sigma of log f about the curve: the zoom's repeatability, or the uncertainty of s. > 0.
  double eps_sigma = 1e-3;
  PictureMotion motion;  // by telemetry
  // Sigma of its angular velocity, rad/s, and zoom rate, 1/s. All 0: exact.
  Vector4<double> motion_sigma = Vector4<double>::Zero();
  Matrix3<double> R_start = Matrix3<double>::Identity();  // start value of R_base_from_camera
  std::optional<OrientationPrior> telemetry;
};

struct MapObservation {
  int picture = 0;        // index into MapEvidence::pictures
  int landmark = 0;       // index, below MapEvidence::landmarks
  Vector2<double> u;      // px
  double sigma_px = 0.2;  // of each coordinate; > 0
};

struct MapEvidence {
  std::vector<MapPicture> pictures;
  int landmarks = 0;  // their number
  std::vector<MapObservation> observations;
};

struct MapOptions {
  LensCurve lens;  // prior; its range must contain all positions
  // Start value, with the same knots; without it `lens`.
  std::optional<LensCurve> start;
  // Prior sigmas of a control point's delta, kappa, c_u, c_v about `lens`, and of second
  // differences of neighbouring control points, likewise about those of `lens`.
  static_assert(kDistortionCount == 1, "a sigma for each quantity");
  LensQuantities level_sigma{0.05, 0.1, 30, 30};
  LensQuantities bend_sigma{0.02, 0.02, 3, 3};
  // One for each control point, in place of level_sigma; empty: level_sigma for all.
  std::vector<LensQuantities> level_sigmas;
  double hold_sigma = 0.5;  // of the lens's hold, about the hold of `lens`
  // rad; an observation whose direction at the start lies farther than this from those of its
  // landmark's other observations is not used.
  double most_start_error = 0.1;
  double gate_sigmas = 4;  // of an observation that is kept; times the noise that was found
  int least_common = 8;    // landmarks in common that connect two pictures
  int max_steps = 100;     // of each round
  int threads = 1;
};

enum class MapStatus {
  kOk,
  kBadInput,       // indices, numbers or options out of range; no picture or no landmark
  kNotConnected,   // see groups
  kNotDetermined,  // singular, or the solver has no usable solution
  kNotConverged,   // within max_steps
};

[[nodiscard]] const char* to_string(MapStatus status);

struct AdjustedPicture {
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();  // at the reference row
  double eps = 0;                                                    // of log f
  Camera<double> camera;
  PictureMotion motion;
};

// Other members than status, groups and steps only with kOk.
struct MapAdjustment {
  MapStatus status = MapStatus::kBadInput;
  // Groups of connected pictures (indices), the largest first; a single one with kOk.
  std::vector<std::vector<int>> groups;
  std::vector<AdjustedPicture> pictures;
  LensCurve lens;
  // Unit directions in base; of zero length if fewer than two observations are left.
  std::vector<Vector3<double>> landmarks;
  std::vector<int> left_out;   // indices of observations, increasing
  Eigen::MatrixXd covariance;  // of (xi, log f) of each picture, 4 rows each
  double hold_sigma = 0;       // of the lens's hold
  double noise_scale = 0;      // rms of the residuals in their sigmas
  int steps = 0;

  [[nodiscard]] Matrix4<double> covariance_of(int picture) const {
    return covariance.block<4, 4>(4 * picture, 4 * picture);
  }
};

[[nodiscard]] MapAdjustment adjust_map(const MapEvidence& evidence, const MapOptions& options);

}  // namespace alidade

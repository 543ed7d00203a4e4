#pragma once
// One landmark's Kalman filter on its direction, from pictures with a known pose (Lisanti, eqs.
// 7-9):
//   y = G (u - project(R, f, d)),  G = (J_u_d B_d)^-1   innovation, rad, B_d = tangent_basis(d)
//   cov_y = J_y_pose cov_pose J_y_pose^T + sigma^2 J_y_u J_y_u^T + P                     (eq. 8)
//   K = P cov_y^-1,  d <- d (+) K y                                                      (eq. 9)
// The error of a landmark has an own part, P, and a part C that it shares with its neighbours
// (scene_map.h). No number of pictures reduces C; a Schmidt filter accounts for it. Derivation:
// docs/derivations.md. Pure; no allocation. Outputs are written with kOk only.

#include "core/mapping/picture_motion.h"
#include "core/model/lens/zoom_law.h"

namespace alidade {

// A picture with its pose in the map.
struct PosedPicture {
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  Camera<double> camera;
  CameraColumn<double> J_camera_log;  // d camera / d log f
  PictureMotion motion;
  Matrix4<double> cov_pose = Matrix4<double>::Zero();  // of (xi, log f): rad, 1
};

// One picture's observation of a landmark, with what eq. 8 needs.
struct LandmarkSight {
  Vector2<double> y;              // rad, in tangent_basis(d)
  Matrix2<double> J_y_u;          // rad/px
  Matrix<double, 2, 4> J_y_pose;  // by (xi, log f)
  Matrix2<double> cov_detection;  // rad^2
  Matrix2<double> cov_of_pose;    // rad^2; the pose's part of eq. 8
};

// u: where the picture shows the landmark, px. sigma_px: of each coordinate of u. d_b: the
// landmark's direction before this picture, unit length. kBeyondDistortionLimit also if J_u_d B_d
// has no inverse.
[[nodiscard]] ProjectionStatus see_landmark(const PosedPicture& picture, const Vector2<double>& u,
                                            double sigma_px, const Vector3<double>& d_b,
                                            LandmarkSight* out);

// Eq. 8, rad^2. covariance: P.
[[nodiscard]] Matrix2<double> innovation_covariance(const LandmarkSight& sight,
                                                    const Matrix2<double>& covariance);

// The symmetric root of a symmetric, positive semidefinite matrix (by Cayley-Hamilton).
[[nodiscard]] Matrix2<double> root_of(const Matrix2<double>& m);

struct LandmarkState {
  Vector3<double> d_b;                // unit direction
  Matrix2<double> covariance;         // own part, P; rad^2, in tangent_basis(d_b)
  Matrix2<double> shared_covariance;  // common part, C; likewise
};

enum class LandmarkUpdate {
  kOk,
  kBeyondGate,  // innovation beyond the gate: another thing, or a mistake; nothing is changed
  kSingular,    // no uncertainty at all; nothing is changed
};

// common: Cp, the common covariance of the landmarks that gave the pose, rad^2, in tangent_basis of
// this landmark's direction. share_of_landmarks: share of the pose's covariance that comes from the
// landmarks' own errors, 0 to 1. news: share of the picture's evidence that earlier pictures did
// not give, above 0, at most 1. A feature's error lasts as long as the light does, so the picture's
// covariances are divided by news. gate_sigmas: largest innovation, in its sigmas.
[[nodiscard]] LandmarkUpdate update_landmark(const LandmarkSight& sight,
                                             const Matrix2<double>& common,
                                             double share_of_landmarks, double news,
                                             double gate_sigmas, LandmarkState* state);

}  // namespace alidade

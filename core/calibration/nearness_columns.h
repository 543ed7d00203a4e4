#pragma once
// NearnessColumns: the normal equations of each landmark's nearness, with its direction eliminated,
// as further landmarks of a Linearisation:
//   c = H_ll^-1 h_l,   h = h_ss - h_l^T c,   g = g_s - c^T g_l,   row to all others: h_o - H_ol c
// s is the nearness, l the direction, o all others; h_ss, h_l, h_o are the entries of s in the
// normal matrix with itself, l and o. Such a landmark's second unknown is a dummy. Errors in units
// of sigma. Allocates. Derivation: docs/calibration.md.

#include <Eigen/LU>
#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

class NearnessColumns {
 public:
  // information: of each nearness's prior, whose mean is 0.
  explicit NearnessColumns(double information) : information_(information) {}

  // The next landmark, at its nearness.
  void begin(double nearness, int control_points) {
    points_.assign(static_cast<std::size_t>(control_points), Vector2<double>::Zero());
    camera_.setZero();
    direction_.setZero();
    square_ = information_;
    gradient_ = -information_ * nearness;
    cost_ += information_ * nearness * nearness;
  }

  // An observation of it that is in use: error and J as in ObservationModel::Result, weight the
  // robust one.
  void add(const TrajectorySpline::Basis& basis, double weight, const Vector2<double>& error,
           const Matrix2<double>& J_angle, const Matrix2<double>& J_landmark,
           const Vector2<double>& J_nearness,
           const Eigen::Matrix<double, 2, kObservedCount>& J_camera) {
    const Vector2<double> J = weight * J_nearness;
    square_ += J.dot(J_nearness);
    gradient_ += J.dot(error);
    direction_ += J_landmark.transpose() * J;
    camera_ += J_camera.transpose() * J;
    for (int i = 0; i < 4; ++i) {
      points_[static_cast<std::size_t>(basis.segment + i)] +=
          basis.weight[i] * (J_angle.transpose() * J);
    }
  }

  // After the observations of landmark l, whose blocks *out has.
  void end(std::size_t l, Linearisation* out) {
    const std::size_t first = out->touched_begin[l];
    const bool seen = first < out->touched_begin[l + 1];
    const Vector2<double> c =
        seen ? Vector2<double>(out->H_landmark[l].inverse() * direction_) : Vector2<double>(0, 0);
    const double left = square_ - direction_.dot(c);
    Matrix2<double> H = Matrix2<double>::Identity();
    H(0, 0) = left;
    H_landmark_.push_back(H);
    g_landmark_.emplace_back(gradient_ - c.dot(out->g_landmark[l]), 0);
    Eigen::Matrix<double, kObservedCount, 2> of_camera;
    of_camera << camera_ - out->H_camera[l] * c, Eigen::Matrix<double, kObservedCount, 1>::Zero();
    H_camera_.push_back(of_camera);
    for (std::size_t i = first; i < out->touched_begin[l + 1]; ++i) {
      Matrix2<double> of_point;
      of_point << points_[static_cast<std::size_t>(out->touched[i])] - out->H_touched[i] * c,
          Vector2<double>::Zero();
      H_touched_.push_back(of_point);
    }
    out->direction_by_nearness.push_back(c);
    if (seen) out->nearness_unknowns += 1 - information_ / left;
  }

  // Once, after the last landmark. Adds the cost of the priors, too.
  void append_to(Linearisation* out) const {
    const std::size_t landmarks = H_landmark_.size();
    const std::size_t count = out->touched.size();
    for (std::size_t l = 0; l < landmarks; ++l)
      out->touched_begin.push_back(count + out->touched_begin[l + 1]);
    out->touched.reserve(2 * count);
    for (std::size_t i = 0; i < count; ++i) out->touched.push_back(out->touched[i]);
    out->H_touched.insert(out->H_touched.end(), H_touched_.begin(), H_touched_.end());
    out->H_landmark.insert(out->H_landmark.end(), H_landmark_.begin(), H_landmark_.end());
    out->g_landmark.insert(out->g_landmark.end(), g_landmark_.begin(), g_landmark_.end());
    out->H_camera.insert(out->H_camera.end(), H_camera_.begin(), H_camera_.end());
    out->cost += cost_;
  }

 private:
  double information_;
  double cost_ = 0;
  std::vector<Vector2<double>> points_;  // of all control points
  Eigen::Matrix<double, kObservedCount, 1> camera_;
  Vector2<double> direction_;
  double square_ = 0;
  double gradient_ = 0;
  std::vector<Matrix2<double>> H_landmark_;
  std::vector<Vector2<double>> g_landmark_;
  std::vector<Matrix2<double>> H_touched_;
  std::vector<Eigen::Matrix<double, kObservedCount, 2>> H_camera_;
};

}  // namespace alidade::internal

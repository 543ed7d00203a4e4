// Start values of MovementAdjustment: log f from the curve, angles from telemetry.

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/calibration/movement_adjustment.h"

namespace alidade::internal {

void MovementAdjustment::set_places() {
  const auto quantities = [&](double reading, Beside* sigma) -> Beside {
    Calibration c;
    if (!curve_.at(reading, &c)) return Beside::Zero();
    if (sigma != nullptr) {
      const CornerDistortion<double> unit = corner_unit(c.camera);
      for (int i = 0; i < kDistortionCount; ++i) {
        (*sigma)[i] = parameter_sigma(c, distortion_parameter(i)) / unit[i];
      }
      sigma->tail<2>() << parameter_sigma(c, Parameter::kCentreU),
          parameter_sigma(c, Parameter::kCentreV);
    }
    return zoom_quantities(c.camera).tail<kBeside>();
  };
  const double from = data_.passed.front().zoom;
  const double to = data_.passed.back().zoom;
  for (const ZoomReading& reading : data_.passed) {
    way_time_s_.push_back(reading.time_s);
    way_share_.push_back((reading.zoom - from) / (to - from));
    way_quantities_.push_back(quantities(reading.zoom, nullptr));
  }
  beside_ = BesideColumns::Zero(kBeside, kPlaces);
  beside_sigma_ = BesideColumns::Zero(kBeside, kPlaces);
  // What the curve takes as exact gets a small sigma, so that the normal equations stay regular.
  Beside least;
  least << CornerDistortion<double>::Constant(1e-6), 1e-4, 1e-4;
  for (int i = 0; i < kPlaces; ++i) {
    Beside sigma = Beside::Zero();
    (void)quantities(from + (to - from) * i / (kPlaces - 1), &sigma);
    beside_sigma_.col(i) = sigma.cwiseMax(least);
  }
}

// Pan and tilt from telemetry, log f from the curve, slightly smoothed.
void MovementAdjustment::set_start() {
  const int points = spline_.control_points();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(points, points);
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(points, 3);
  const auto add = [&](double time, int axis, double value, Eigen::MatrixXd* matrix) {
    const ZoomMotionSpline::Basis at = basis(time);
    for (int i = 0; i < 4; ++i) {
      g(at.segment + i, axis) += at.weight[i] * value;
      for (int j = 0; j < 4; ++j) {
        (*matrix)(at.segment + i, at.segment + j) += at.weight[i] * at.weight[j];
      }
    }
  };
  constexpr double kSmoothing = 1e-3;
  for (int i = 2; i < points; ++i) {
    Eigen::VectorXd bend = Eigen::VectorXd::Zero(points);
    bend[i - 2] = 1;
    bend[i - 1] = -2;
    bend[i] = 1;
    H += kSmoothing * bend * bend.transpose();
  }
  Eigen::MatrixXd H_f = H;
  Eigen::MatrixXd unused = H;
  for (const AdjustmentTelemetry& sample : data_.input.telemetry) {
    const double time = sample.time_s - shared_.clock_offset;
    if (time < data_.begin_s || time > data_.end_s) continue;
    add(time, 0, sample.measured[0] / shared_.mechanics.pan_scale, &H);
    add(time, 1, sample.measured[1] / shared_.mechanics.tilt_scale, &unused);
  }
  constexpr int kPerSegment = 3;
  for (int i = 0; i <= kPerSegment * spline_.segments(); ++i) {
    const double time = spline_.begin_s() + (spline_.end_s() - spline_.begin_s()) * i /
                                                (kPerSegment * spline_.segments());
    const auto [at, share] = passing_at(time);
    const double reading = (1 - share) * data_.passed[at - 1].zoom + share * data_.passed[at].zoom;
    Calibration c;
    if (curve_.at(reading, &c)) add(time, 2, std::log(c.camera.focal_length), &H_f);
  }
  const Eigen::MatrixXd angles = H.ldlt().solve(g.leftCols<2>());
  const Eigen::VectorXd log_f = H_f.ldlt().solve(g.col(2));
  Calibration first;
  Calibration second;
  const bool known =
      curve_.at(data_.passed.front().zoom, &first) && curve_.at(data_.passed.back().zoom, &second);
  for (int i = 0; i < points; ++i) {
    const int unknown = log_f_unknown_[static_cast<std::size_t>(i)];
    double f = log_f[i];
    if (known && unknown == 0) f = std::log(first.camera.focal_length);
    if (known && unknown == 1) f = std::log(second.camera.focal_length);
    spline_.control_point(i) << angles(i, 0), angles(i, 1), f;
  }
}

// Each landmark starts at the mean direction of its observations.
void MovementAdjustment::set_landmarks() {
  auto& observations = data_.input.observations;
  std::vector<char> is_seen(data_.input.frame_time_s.size(), 0);
  std::vector<Vector3<double>> sums;
  for (AdjustmentObservation& seen : observations) {
    if (static_cast<std::size_t>(seen.landmark) >= sums.size()) {
      sums.resize(static_cast<std::size_t>(seen.landmark) + 1, Vector3<double>::Zero());
    }
    const double time = data_.input.frame_time_s[static_cast<std::size_t>(seen.frame)] +
                        seen.u.y() * shared_.line_delay;
    const ZoomMotionSpline::Point at = spline_.value(basis(time));
    Vector3<double> d_c;
    if (unproject(camera_at(at[2], lens_at(time)), seen.u, &d_c) != ProjectionStatus::kOk) {
      seen.used = false;
      continue;
    }
    is_seen[static_cast<std::size_t>(seen.frame)] = 1;
    sums[static_cast<std::size_t>(seen.landmark)] +=
        R_base_from_camera(shared_.mechanics, PanTilt<double>{at[0], at[1]}) * d_c;
  }
  frames_ = static_cast<int>(std::count(is_seen.begin(), is_seen.end(), 1));
  for (const Vector3<double>& sum : sums) {
    landmarks_.push_back(sum.norm() > 0 ? Vector3<double>(sum.normalized())
                                        : Vector3<double>::UnitX());
  }
}

}  // namespace alidade::internal

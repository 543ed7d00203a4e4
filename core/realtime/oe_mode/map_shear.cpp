#include "core/realtime/oe_mode/map_shear.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {

bool MapShearOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(crooked_px > 0)) problem = "crooked_px must be positive";
  if (!(doubt >= 1)) problem = "doubt must be at least 1";
  if (!(max_surprise > 0)) problem = "max_surprise must be positive";
  if (!(of_surprise > 0)) problem = "of_surprise must be positive";
  if (!(longest_s > 0)) problem = "longest_s must be positive";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

Vector2<double> ShearCorrection::angle_error(double t) const {
  const double within = std::clamp(t, -half_readout_s, half_readout_s);
  return t * rate + (0.5 * within * within) * acceleration;
}

void ShearCorrection::straighten(Vector2<double>* angles, Vector2<double>* rates,
                                 Vector2<double>* accelerations) const {
  const double t = time_of(angles->y());
  *angles -= angle_error(t);
  *rates -= rate + t * acceleration;
  *accelerations -= acceleration;
}

FrameMotion<double> ShearCorrection::straightened(const FrameMotion<double>& motion) const {
  Vector2<double> angles = motion.angle.vector();
  Vector2<double> rates = motion.rate.vector();
  Vector2<double> accelerations = motion.acceleration.vector();
  straighten(&angles, &rates, &accelerations);
  FrameMotion<double> out = motion;
  out.angle = {angles.x(), angles.y()};
  out.rate = {rates.x(), rates.y()};
  out.acceleration = {accelerations.x(), accelerations.y()};
  return out;
}

void ShearCorrection::straighten(const Calibration& calibration, const FrameMotion<double>& motion,
                                 LandmarkMap* map) const {
  const Vector3<double>& a_pan = calibration.mechanics.pan_axis;
  const auto elevation_of = [&](const Vector3<double>& d) {
    return -std::asin(std::clamp(a_pan.dot(d), -1.0, 1.0));
  };
  // Elevation of the optical axis of a frame that looks at `tilt`.
  const double origin =
      elevation_of(ViewProjection(calibration, motion).optical_axis()) - (motion.angle.tilt - tilt);
  for (int slot = 0; slot < map->capacity(); ++slot) {
    if (!map->occupied(slot)) continue;
    const Landmark& landmark = map->at(slot);
    const Vector3<double>& d = landmark.d;
    const Vector2<double> error = angle_error(s_per_rad * (elevation_of(d) - origin));
    const Vector3<double> right = a_pan.cross(d);
    const Vector3<double> turned = d - error.x() * right - error.y() * right.normalized().cross(d);
    map->refine(slot, turned.normalized(), landmark.covariance);
  }
}

void MapShear::reset(const Calibration& calibration) {
  take_lens(calibration);
  for (Matrix3<double>& covariance : covariances_) covariance.setZero();
  frame_count_ = 0;
}

void MapShear::change_lens(const Calibration& calibration) {
  const double before = s_per_rad_;
  take_lens(calibration);
  if (!(before * s_per_rad_ > 0)) return;
  // Error of an angle at an elevation: rate * s_per_rad * elevation.
  const double ratio = before / s_per_rad_;
  const Vector3<double> scale(1, ratio, ratio * ratio);
  for (Matrix3<double>& covariance : covariances_) {
    covariance = (scale.asDiagonal() * covariance * scale.asDiagonal()).eval();
  }
}

void MapShear::take_lens(const Calibration& calibration) {
  const Camera<double>& camera = calibration.camera;
  s_per_rad_ = -calibration.line_delay * camera.focal_length * camera.aspect;
  half_readout_s_ = std::abs(calibration.line_delay * camera.height / 2);
  focal_length_ = camera.focal_length;
  field_of_view_ = 2 * std::atan(0.5 * camera.width / camera.focal_length);
}

void MapShear::set(const Covariances& covariances, double tilt) {
  covariances_ = covariances;
  tilt_ = tilt;
}

void MapShear::begin(const FrameMotion<double>& motion, const Matrix6& motion_covariance) {
  frame_count_ = 0;
  tilt_ = motion.angle.tilt;
  for (Matrix3<double>& covariance : covariances_) covariance.setZero();
  inherit(1, motion_covariance);
}

void MapShear::inherit(double share, const Matrix6& motion_covariance) {
  for (int axis = 0; axis < 2; ++axis) {
    covariances_[static_cast<std::size_t>(axis)].bottomRightCorner<2, 2>() +=
        share * share * rate_covariance(motion_covariance, axis);
  }
}

void MapShear::move_to(double tilt) {
  const double t = s_per_rad_ * (tilt - tilt_);
  Matrix3<double> carry = Matrix3<double>::Identity();
  carry(0, 1) = t;
  carry(0, 2) = t * t / 2;
  carry(1, 2) = t;
  for (Matrix3<double>& covariance : covariances_) {
    covariance = carry * covariance * carry.transpose();
    covariance = symmetric(covariance);
  }
  tilt_ = tilt;
}

void MapShear::add_to(Matrix6* motion_covariance) const {
  for (int axis = 0; axis < 2; ++axis) {
    const Matrix3<double>& shear = covariances_[static_cast<std::size_t>(axis)];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*motion_covariance)(2 * i + axis, 2 * j + axis) += shear(i, j);
    }
  }
}

Matrix2<double> MapShear::angle_covariance() const {
  return Vector2<double>(covariances_[0](0, 0), covariances_[1](0, 0)).asDiagonal();
}

// The curve through the earlier angles predicts this one. A jerk shows as a surprise.
void MapShear::add_frame(double middle_row_time_s, const FrameMotion<double>& motion,
                         const Matrix6& motion_covariance) {
  const double since_s = middle_row_time_s - frames_[0].time_s;
  if (frame_count_ > 0 && !(since_s > 0 && since_s < options_.longest_s)) frame_count_ = 0;
  Frame now{middle_row_time_s,
            motion.angle.vector(),
            motion.rate.vector(),
            motion.acceleration.vector(),
            motion_covariance,
            Vector2<double>::Constant(field_of_view_),
            s_per_rad_};
  if (frame_count_ >= kCurve) {
    now.surprise = now.angle;
    for (std::size_t i = 0; i < kCurve; ++i) {
      double weight = 1;
      for (std::size_t j = 0; j < kCurve; ++j) {
        if (j == i) continue;
        weight *= (middle_row_time_s - frames_[j].time_s) / (frames_[i].time_s - frames_[j].time_s);
      }
      now.surprise -= weight * frames_[i].angle;
    }
  }
  std::copy_backward(frames_.begin(), frames_.end() - 1, frames_.end());
  frames_[0] = now;
  frame_count_ = std::min(frame_count_ + 1, frames_.size());
}

std::optional<ShearCorrection> MapShear::correct() {
  if (frame_count_ < frames_.size() || half_readout_s_ == 0) return std::nullopt;
  if (std::abs(frames_.back().s_per_rad / s_per_rad_ - 1) > kSameLens) return std::nullopt;
  const Frame& middle = frames_[kCurve / 2];
  // s, mean time between frames.
  const double h = (frames_[0].time_s - frames_[kCurve - 1].time_s) / (kCurve - 1);
  Matrix<double, kCurve, kCurve> powers;
  for (std::size_t i = 0; i < kCurve; ++i) {
    const double t = (frames_[i].time_s - middle.time_s) / h;
    powers.row(static_cast<int>(i)) << 1, t, t * t, t * t * t, t * t * t * t;
  }
  const Matrix<double, kCurve, kCurve> to_coefficients = powers.inverse();
  const Matrix<double, 1, kCurve> to_rate = to_coefficients.row(1) / h;
  const Matrix<double, 1, kCurve> to_acceleration = 2 * to_coefficients.row(2) / (h * h);
  Vector2<double> rate = Vector2<double>::Zero();
  Vector2<double> acceleration = Vector2<double>::Zero();
  for (std::size_t i = 0; i < kCurve; ++i) {
    rate += to_rate[static_cast<int>(i)] * frames_[i].angle;
    acceleration += to_acceleration[static_cast<int>(i)] * frames_[i].angle;
  }
  const Vector2<double> surprise =
      options_.of_surprise * frames_[0]
                                 .surprise.cwiseAbs()
                                 .cwiseMax(frames_[1].surprise.cwiseAbs())
                                 .cwiseMax(frames_[2].surprise.cwiseAbs());
  move_to(middle.angle.y());
  ShearCorrection out;
  out.tilt = middle.angle.y();
  out.s_per_rad = s_per_rad_;
  out.half_readout_s = half_readout_s_;
  for (int axis = 0; axis < 2; ++axis) {
    Matrix3<double>& shear = covariances_[static_cast<std::size_t>(axis)];
    const Vector2<double> wrong(middle.rate[axis] - rate[axis],
                                middle.acceleration[axis] - acceleration[axis]);
    Matrix2<double> noise = rate_covariance(middle.covariance, axis);
    const double angle_variance = middle.covariance(axis, axis);
    const double rate_surprise = surprise[axis] / h;
    const double acceleration_surprise = surprise[axis] / (h * h);
    noise(0, 0) += to_rate.squaredNorm() * angle_variance + rate_surprise * rate_surprise;
    noise(1, 1) += to_acceleration.squaredNorm() * angle_variance +
                   acceleration_surprise * acceleration_surprise;
    const Matrix2<double> to_information = (shear.bottomRightCorner<2, 2>() + noise).inverse();
    if (!(wrong.dot(to_information * wrong) < options_.max_surprise)) {
      // A jerk, or a shear larger than expected: if it stays, it will be believed. Its effect on
      // the angle comes from move_to() alone, as nothing here could ever remove it again.
      const double factor = std::sqrt(options_.doubt);
      const Vector3<double> doubt(1, factor, factor);
      shear = (doubt.asDiagonal() * shear * doubt.asDiagonal()).eval();
      continue;
    }
    const Matrix<double, 3, 2> gain = shear.rightCols<2>() * to_information;
    const Vector3<double> error = gain * wrong;
    // The angle error has grown with the way from where the map began, by the former rate error.
    out.angle[axis] = error[0];
    out.rate[axis] = error[1];
    out.acceleration[axis] = error[2];
    shear -= gain * shear.bottomRows<2>();
    shear = symmetric(shear);
  }
  for (std::size_t i = 0; i < frame_count_; ++i) {
    out.straighten(&frames_[i].angle, &frames_[i].rate, &frames_[i].acceleration);
  }
  out.crooked = out.rate.norm() * half_readout_s_ * focal_length_ > options_.crooked_px;
  return out;
}

}  // namespace alidade

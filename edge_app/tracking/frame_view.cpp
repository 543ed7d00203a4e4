#include "edge_app/tracking/frame_view.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/ground/plane_homography.h"
#include "core/model/direction.h"

namespace alidade {
namespace {

// Of the pinhole camera. d_c: direction in the camera frame, d_c.z() > 0.
Matrix<double, 2, 3> pinhole_jacobian(const Matrix3<double>& K, const Vector3<double>& d_c) {
  const double z = d_c.z();
  Matrix<double, 2, 3> J;
  J << K(0, 0) / z, 0, -K(0, 0) * d_c.x() / (z * z),  //
      0, K(1, 1) / z, -K(1, 1) * d_c.y() / (z * z);
  return J;
}

}  // namespace

FrameView::FrameView(const OrientationRecord& record)
    : frame_(unpack(record.orientation->geometry, record.camera)), motion_frame_(frame_) {
  motion_frame_.calibration.covariance.setZero();
  const Calibration& calibration = frame_.calibration;
  const FrameMotion<double> motion = frame_.motion();
  const double row = calibration.camera.height / 2.0;
  time_s_ = *record.time_s + row * calibration.line_delay;
  K_ = camera_matrix(camera_at_row(calibration.camera, motion, calibration.line_delay, row));
  R_camera_from_base_ =
      R_base_from_camera(calibration.mechanics, angle_at_row(motion, calibration.line_delay, row))
          .transpose();
  region_ = find_region();
}

FrameOrientation FrameView::shared_frame() const {
  FrameOrientation out = frame_;
  out.motion_covariance.setZero();
  return out;
}

double FrameView::area_px2() const {
  const Camera<double>& camera = frame_.calibration.camera;
  return static_cast<double>(camera.width) * camera.height;
}

bool FrameView::contains(const Vector2<double>& u) const {
  const Camera<double>& camera = frame_.calibration.camera;
  return u.x() >= 0 && u.x() <= camera.width && u.y() >= 0 && u.y() <= camera.height;
}

Matrix3<double> FrameView::H_measured_from_world(const WorldPlane* plane) const {
  if (plane == nullptr) return K_ * R_camera_from_base_;
  return image_from_plane(K_, R_camera_from_base_, *plane);
}

std::optional<Vector2<double>> FrameView::place_of(const Vector2<double>& u) const {
  Vector3<double> d_b;
  if (frame_.direction(u, &d_b) != ProjectionStatus::kOk) return std::nullopt;
  const Vector3<double> d_c = R_camera_from_base_ * d_b;
  if (!(d_c.z() > 0)) return std::nullopt;
  return Vector2<double>((K_ * d_c).head<2>() / d_c.z());
}

ViewRegion FrameView::find_region() const {
  const double w = frame_.calibration.camera.width;
  const double h = frame_.calibration.camera.height;
  const std::array<Vector2<double>, 4> corners = {Vector2<double>(0, 0), Vector2<double>(w, 0),
                                                  Vector2<double>(w, h), Vector2<double>(0, h)};
  constexpr std::size_t kSteps = 8;  // per side
  std::array<Vector2<double>, 4 * kSteps> rim;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Vector2<double>& from = corners[i / kSteps];
    const Vector2<double>& to = corners[(i / kSteps + 1) % corners.size()];
    const auto place = place_of(from + static_cast<double>(i % kSteps) / kSteps * (to - from));
    if (!place) return {};
    rim[i] = *place;
  }
  ViewRegion region;
  for (std::size_t i = 0; i < rim.size(); i += kSteps) {
    const Vector2<double> along = (rim[(i + kSteps) % rim.size()] - rim[i]).normalized();
    const Vector2<double> inwards(-along.y(), along.x());
    double least = inwards.dot(rim[i]);
    for (const Vector2<double>& place : rim) least = std::min(least, inwards.dot(place));
    region.edges[static_cast<std::size_t>(region.count++)] = {inwards.x(), inwards.y(), -least};
  }
  return region;
}

std::optional<TargetMeasurement> FrameView::measure(const Vector2<double>& u,
                                                    double sigma_px) const {
  Vector3<double> d_b;
  Matrix2<double> cov_d;
  Matrix<double, 3, 2> J_d_u;
  const Calibration& calibration = frame_.calibration;
  if (motion_frame_.direction(u, &d_b, &cov_d) != ProjectionStatus::kOk ||
      rolling_shutter_unproject(calibration.camera, calibration.mechanics, calibration.line_delay,
                                frame_.motion(), u, &d_b, &J_d_u) != ProjectionStatus::kOk) {
    return std::nullopt;
  }
  const Vector3<double> d_c = R_camera_from_base_ * d_b;
  if (!(d_c.z() > 0)) return std::nullopt;
  TargetMeasurement out;
  out.place = (K_ * d_c).head<2>() / d_c.z();
  const Matrix<double, 2, 3> J_p_d = pinhole_jacobian(K_, d_c) * R_camera_from_base_;
  const Matrix2<double> J_p_u = J_p_d * J_d_u;
  const Matrix2<double> J_p_tangent = J_p_d * tangent_basis(d_b);
  out.cov = sigma_px * sigma_px * J_p_u * J_p_u.transpose();
  out.cov += J_p_tangent * cov_d * J_p_tangent.transpose();
  out.cov = (out.cov + out.cov.transpose()).eval() / 2;
  return out;
}

}  // namespace alidade

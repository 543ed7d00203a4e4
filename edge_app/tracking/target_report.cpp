#include "edge_app/tracking/target_report.h"

#include <cmath>

#include "core/ground/image_plane.h"
#include "core/model/direction.h"
#include "edge_app/tracking/frame_view.h"

namespace alidade {
namespace {

// Reverses the direction of time.
void reverse_velocity(TargetState* state) {
  state->mean.tail<2>() *= -1;
  state->cov.topRightCorner<2, 2>() *= -1;
  state->cov.bottomLeftCorner<2, 2>() *= -1;
}

// Moves a target at constant velocity, forwards or back.
TargetState moved(const TargetsState& all, const TargetState& from, double dt_s) {
  TargetState state = from;
  if (dt_s < 0) reverse_velocity(&state);
  predict_target(all.space, std::abs(dt_s), all.acceleration_density, &state);
  if (dt_s < 0) reverse_velocity(&state);
  return state;
}

// Jacobian of azimuth and elevation of a unit direction away from the poles.
Matrix<double, 2, 3> angles_jacobian(const Vector3<double>& d) {
  const double level = d.head<2>().norm();
  Matrix<double, 2, 3> J;
  J << -d.y() / (level * level), d.x() / (level * level), 0,  //
      d.x() * d.z() / level, d.y() * d.z() / level, -level;
  return J;
}

constexpr double kLeastLevel = 1e-6;  // sine of the angle between a direction and a pole

bool on_plane(const PlaneEstimate& plane, const FrameView& view, const TargetState& state,
              TargetReport* out) {
  const Vector3<double> P_w(state.mean.x(), state.mean.y(), 0);
  if (direction_of(plane.plane, P_w, &out->d_b) != PlaneStatus::kOk) return false;
  out->state = state.mean;
  out->cov = state.cov;
  if (plane.origin) out->on_earth = LocalFrame(*plane.origin).geodetic(P_w);
  PlanePixel pixel;
  if (pixel_of_point(plane.plane, view.frame(), P_w, &pixel) != PlaneStatus::kOk ||
      !view.contains(pixel.u))
    return true;
  out->pixel = pixel.u;
  const Matrix2<double> J = pixel.J_u_P.leftCols<2>();
  out->cov_px = J * state.cov.topLeftCorner<2, 2>() * J.transpose();
  return true;
}

bool on_sphere(const FrameView& view, const TargetState& state, TargetReport* out) {
  out->d_b = target_direction(state);
  if (const auto angles = azimuth_elevation(state)) {
    out->state = angles->value;
    out->cov = angles->cov;
  }
  const FrameOrientation& frame = view.frame();
  Vector2<double> u;
  Matrix<double, 2, 3> J_u_d;
  if (rolling_shutter_project(frame.calibration.camera, frame.calibration.mechanics,
                              frame.calibration.line_delay, frame.motion(), out->d_b, &u,
                              &J_u_d) != ProjectionStatus::kOk ||
      !view.contains(u))
    return true;
  out->pixel = u;
  // Azimuth grows along the chart's y axis, elevation along its -z axis.
  Matrix<double, 3, 2> J_d_place;
  J_d_place << state.R_base_from_chart.col(1), -state.R_base_from_chart.col(2);
  const Matrix2<double> J = J_u_d * J_d_place;
  out->cov_px = J * state.cov.topLeftCorner<2, 2>() * J.transpose();
  return true;
}

// px per metre, or px per radian.
double scale_of(const TargetsState& all, const FrameView& view, const TargetReport& report) {
  if (!all.plane) return view.focal_length();
  const Vector3<double> P_w(report.state->x(), report.state->y(), 0);
  return view.focal_length() / (P_w - all.plane->plane.position).norm();
}

}  // namespace

bool shared_covariance(const FrameOrientation& shared_frame, const PlaneEstimate* plane,
                       const Vector2<double>& u, Matrix2<double>* cov) {
  if (plane != nullptr) {
    PlanePoint point;
    if (plane_point_of_pixel(plane->plane, shared_frame, u, Matrix2<double>::Zero(), {}, &point) !=
        PlaneStatus::kOk)
      return false;
    *cov = point.covariance;
    return true;
  }
  Vector3<double> d_b;
  Matrix2<double> cov_d;
  if (shared_frame.direction(u, &d_b, &cov_d) != ProjectionStatus::kOk ||
      d_b.head<2>().norm() < kLeastLevel)
    return false;
  const Matrix2<double> J = angles_jacobian(d_b) * tangent_basis(d_b);
  *cov = J * cov_d * J.transpose();
  return true;
}

TargetList list_targets(const TargetsState& state, const OrientationRecord& record) {
  TargetList list;
  list.frame = record.frame;
  list.time_s = FrameView(record).time_s();
  list.detected_frame = state.record.frame;
  list.space = state.space;
  list.targets = report_targets(state, record);
  return list;
}

std::vector<TargetReport> report_targets(const TargetsState& state,
                                         const OrientationRecord& record) {
  std::vector<TargetReport> out;
  const FrameView view(record);
  const FrameOrientation shared = view.shared_frame();
  for (const TrackedTarget& one : state.targets) {
    TargetReport report;
    report.identity = one.target.identity;
    report.name = one.look.name;
    report.score = one.look.score;
    report.born_s = one.target.born_s;
    report.seen_s = one.target.seen_s;
    report.in_view = one.target.in_view;
    const TargetState there = moved(state, one.target.state, view.time_s() - state.time_s);
    const bool known = state.plane ? on_plane(*state.plane, view, there, &report)
                                   : on_sphere(view, there, &report);
    if (!known) continue;
    Matrix2<double> shared_cov = one.look.shared_cov;
    if (report.pixel)
      static_cast<void>(shared_covariance(shared, state.plane.get(), *report.pixel, &shared_cov));
    report.cov.topLeftCorner<2, 2>() += shared_cov;
    report.cov = (report.cov + report.cov.transpose()).eval() / 2;
    if (report.pixel && one.look.scale > 0) {
      const double factor = scale_of(state, view, report) / one.look.scale;
      DetectionBox box;
      box.width = factor * one.look.width;
      box.height = factor * one.look.height;
      box.u = report.pixel->x() - box.width / 2;
      box.v = report.pixel->y() - (state.plane ? box.height : box.height / 2);
      report.box = box;
    }
    out.push_back(std::move(report));
  }
  return out;
}

}  // namespace alidade

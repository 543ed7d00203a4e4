// The normal equations of MovementAdjustment: residuals by unknowns, with landmarks eliminated.

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/calibration/movement_adjustment.h"
#include "core/model/direction.h"

namespace alidade::internal {
namespace {

constexpr double kLogFSigma = 0.5;  // where no frame sees log f, it stays near the start
constexpr double kLostPixelSquare = 1e6;

Matrix2<double> damped(Matrix2<double> H, double damping) {
  H.diagonal() *= 1 + damping;
  return H;
}

double robust_weight(double square, double loss) { return 1 / (1 + square / (loss * loss)); }
double robust_square(double square, double loss) {
  return loss * loss * std::log1p(square / (loss * loss));
}

}  // namespace

MovementAdjustment::Passing MovementAdjustment::passing_at(double time_s) const {
  if (time_s < way_time_s_.front()) return {1, 0};
  if (time_s >= way_time_s_.back()) return {way_time_s_.size() - 1, 1};
  const auto after = std::upper_bound(way_time_s_.begin(), way_time_s_.end(), time_s);
  const auto i = static_cast<std::size_t>(after - way_time_s_.begin());
  return {i, (time_s - way_time_s_[i - 1]) / (way_time_s_[i] - way_time_s_[i - 1])};
}

Camera<double> MovementAdjustment::camera_at(double log_f, const LensPlace& lens) const {
  Camera<double> camera = shared_.camera;
  ZoomQuantities<double> quantities;
  quantities << log_f, lens.quantities;
  set_zoom_quantities(quantities, &camera);
  return camera;
}

MovementAdjustment::LensPlace MovementAdjustment::lens_at(double time_s) const {
  LensPlace place;
  const auto [i, share] = passing_at(time_s);
  place.quantities = (1 - share) * way_quantities_[i - 1] + share * way_quantities_[i];
  const double at = ((1 - share) * way_share_[i - 1] + share * way_share_[i]) * (kPlaces - 1);
  place.first = std::clamp(static_cast<int>(at), 0, kPlaces - 2);
  place.share = at - place.first;
  place.quantities +=
      (1 - place.share) * beside_.col(place.first) + place.share * beside_.col(place.first + 1);
  return place;
}

bool MovementAdjustment::observe(const AdjustmentObservation& seen, Row* row) const {
  const double time = data_.input.frame_time_s[static_cast<std::size_t>(seen.frame)] +
                      seen.u.y() * shared_.line_delay;
  const ZoomMotionSpline::Basis at = basis(time);
  const ZoomMotionSpline::Point motion = spline_.value(at);
  const ZoomMotionSpline::Point rate = spline_.derivative(at);
  const LensPlace lens = lens_at(time);
  const Camera<double> camera = camera_at(motion[2], lens);
  const Vector3<double>& d_b = landmarks_[static_cast<std::size_t>(seen.landmark)];
  Matrix<double, 3, 2> J_xi_angle;
  const Matrix3<double> R =
      R_base_from_camera(shared_.mechanics, PanTilt<double>{motion[0], motion[1]}, &J_xi_angle);
  const Vector3<double> d_c = R.transpose() * d_b;
  Vector2<double> u;
  Matrix<double, 2, 3> J_u_dc;
  Matrix<double, 2, kCameraParameterCount> J_u_camera;
  if (project(camera, d_c, &u, &J_u_dc, &J_u_camera) != ProjectionStatus::kOk) return false;
  const Matrix2<double> J_u_angle = J_u_dc * skew(d_c) * J_xi_angle;
  const Vector2<double> J_u_log_f = by_zoom(camera, J_u_camera);
  const Vector2<double> J_u_row =
      (J_u_angle * rate.head<2>() + J_u_log_f * rate[2]) * shared_.line_delay;
  constexpr double kMaxSlope = 0.9;
  if (J_u_row.y() > kMaxSlope) return false;
  Matrix2<double> whiten;
  whiten << 1, J_u_row.x() / (1 - J_u_row.y()), 0, 1 / (1 - J_u_row.y());
  whiten /= seen.sigma;
  row->error = whiten * (seen.u - u);
  row->index.clear();
  row->J.clear();
  const auto add = [&](int unknown, const Vector2<double>& J) {
    row->index.push_back(unknown);
    row->J.push_back(J);
  };
  const Matrix2<double> J_angle = whiten * J_u_angle;
  const Vector2<double> J_log_f = whiten * J_u_log_f;
  for (int i = 0; i < 4; ++i) {
    const int point = at.segment + i;
    const double weight = at.weight[i];
    add(point_row(point), weight * J_angle.col(0));
    add(point_row(point) + 1, weight * J_angle.col(1));
    add(log_f_unknown(point), weight * J_log_f);
  }
  const CornerDistortion<double> unit = corner_unit(camera);
  for (const int which : {0, 1}) {
    const double share = which == 0 ? 1 - lens.share : lens.share;
    const int first = first_beside() + kBeside * (lens.first + which);
    for (int i = 0; i < kDistortionCount; ++i) {
      add(first + i, share * unit[i] * (whiten * J_u_camera.col(camera_column::kDistortion + i)));
    }
    add(first + kDistortionCount, share * whiten.col(0));
    add(first + kDistortionCount + 1, share * whiten.col(1));
  }
  row->J_landmark = whiten * J_u_dc * R.transpose() * tangent_basis(d_b);
  return true;
}

void MovementAdjustment::linearise(double loss_px, bool with_derivatives, Normal* out) const {
  *out = {};
  const auto count = landmarks_.size();
  if (with_derivatives) {
    out->H.setZero(unknowns_, unknowns_);
    out->g.setZero(unknowns_);
    out->H_landmark.assign(count, Matrix2<double>::Zero());
    out->g_landmark.assign(count, Vector2<double>::Zero());
    out->touched.resize(count);
    out->H_touched.resize(count);
  }
  const bool robust = std::isfinite(loss_px);
  std::vector<int> place(static_cast<std::size_t>(unknowns_), -1);
  std::size_t current = count;
  Row row;
  for (const AdjustmentObservation& seen : data_.input.observations) {
    out->pixel_square.push_back(-1);
    if (!seen.used) {
      if (observe(seen, &row)) out->pixel_square.back() = row.error.squaredNorm();
      continue;
    }
    if (!observe(seen, &row)) {
      out->cost += robust ? robust_square(kLostPixelSquare, loss_px) : kLostPixelSquare;
      continue;
    }
    const double square = row.error.squaredNorm();
    out->pixel_square.back() = square;
    out->cost += robust ? robust_square(square, loss_px) : square;
    if (!with_derivatives) continue;
    const double weight = robust ? robust_weight(square, loss_px) : 1;
    const auto l = static_cast<std::size_t>(seen.landmark);
    if (l != current) {
      if (current < count) {
        for (const int i : out->touched[current]) place[static_cast<std::size_t>(i)] = -1;
      }
      current = l;
    }
    for (std::size_t i = 0; i < row.index.size(); ++i) {
      const int a = row.index[i];
      const Vector2<double> Jw = weight * row.J[i];
      out->g[a] += Jw.dot(row.error);
      for (std::size_t j = 0; j < row.index.size(); ++j) {
        if (row.index[j] <= a) out->H(a, row.index[j]) += Jw.dot(row.J[j]);
      }
      int& at = place[static_cast<std::size_t>(a)];
      if (at < 0) {
        at = static_cast<int>(out->touched[l].size());
        out->touched[l].push_back(a);
        out->H_touched[l].emplace_back(Vector2<double>::Zero());
      }
      out->H_touched[l][static_cast<std::size_t>(at)] += row.J_landmark.transpose() * Jw;
    }
    out->H_landmark[l] += weight * row.J_landmark.transpose() * row.J_landmark;
    out->g_landmark[l] += weight * row.J_landmark.transpose() * row.error;
  }
  for (const AdjustmentTelemetry& sample : data_.input.telemetry) {
    const double time = sample.time_s - shared_.clock_offset;
    if (time < data_.begin_s || time > data_.end_s) continue;
    const ZoomMotionSpline::Basis at = basis(time);
    const ZoomMotionSpline::Point motion = spline_.value(at);
    const Vector2<double> scale(shared_.mechanics.pan_scale, shared_.mechanics.tilt_scale);
    const Vector2<double> error =
        (sample.measured - scale.cwiseProduct(motion.head<2>())) / telemetry_sigma_;
    constexpr double kLoss = 3;
    for (int axis = 0; axis < 2; ++axis) {
      const double square = error[axis] * error[axis];
      out->cost += robust_square(square, kLoss);
      out->telemetry_square += std::min(square, kLoss * kLoss);
      ++out->telemetry_count;
      if (!with_derivatives) continue;
      const double weight = robust_weight(square, kLoss);
      for (int i = 0; i < 4; ++i) {
        const int a = point_row(at.segment + i) + axis;
        const double J = at.weight[i] * scale[axis] / telemetry_sigma_;
        out->g[a] += weight * J * error[axis];
        for (int j = 0; j <= i; ++j) {
          out->H(a, point_row(at.segment + j) + axis) +=
              weight * J * at.weight[j] * scale[axis] / telemetry_sigma_;
        }
      }
    }
  }
  for (int i = 0; i < kBeside * kPlaces; ++i) {
    const double sigma = beside_sigma_(i % kBeside, i / kBeside);
    const double n = beside_(i % kBeside, i / kBeside);
    out->cost += n * n / (sigma * sigma);
    if (!with_derivatives) continue;
    const int a = first_beside() + i;
    out->H(a, a) += 1 / (sigma * sigma);
    out->g[a] -= n / (sigma * sigma);
  }
  if (!with_derivatives) return;
  // Limits the steps of log f without a prior of its value.
  for (int i = 0; i < log_f_unknowns_; ++i) {
    const int a = first_log_f() + i;
    out->H(a, a) += 1 / (kLogFSigma * kLogFSigma);
  }
}

bool MovementAdjustment::reduce(const Normal& normal, double damping, Eigen::MatrixXd* H,
                                Eigen::VectorXd* g) const {
  *H = normal.H;
  *g = normal.g;
  H->diagonal() *= 1 + damping;
  for (std::size_t l = 0; l < landmarks_.size(); ++l) {
    const std::vector<int>& touched = normal.touched[l];
    if (touched.empty()) continue;
    const Matrix2<double> H_l = damped(normal.H_landmark[l], damping);
    if (!(H_l.determinant() > 1e-12 * std::pow(H_l.trace(), 2))) return false;
    const Matrix2<double> inverse = H_l.inverse();
    for (std::size_t i = 0; i < touched.size(); ++i) {
      const Vector2<double> weighted = inverse * normal.H_touched[l][i];
      (*g)[touched[i]] -= weighted.dot(normal.g_landmark[l]);
      for (std::size_t j = 0; j < touched.size(); ++j) {
        if (touched[j] <= touched[i]) {
          (*H)(touched[i], touched[j]) -= weighted.dot(normal.H_touched[l][j]);
        }
      }
    }
  }
  return true;
}

bool MovementAdjustment::solve(const Normal& normal, double damping, Eigen::VectorXd* x,
                               std::vector<Vector2<double>>* x_landmark) const {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  if (!reduce(normal, damping, &H, &g)) return false;
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = scale.asDiagonal() * H * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(H);
  if (llt.info() != Eigen::Success) return false;
  const Eigen::VectorXd scaled = scale.asDiagonal() * g;
  *x = scale.asDiagonal() * llt.solve(scaled);
  x_landmark->assign(landmarks_.size(), Vector2<double>::Zero());
  for (std::size_t l = 0; l < landmarks_.size(); ++l) {
    if (normal.touched[l].empty()) continue;
    Vector2<double> right = normal.g_landmark[l];
    for (std::size_t i = 0; i < normal.touched[l].size(); ++i) {
      right -= normal.H_touched[l][i] * (*x)[normal.touched[l][i]];
    }
    (*x_landmark)[l] = damped(normal.H_landmark[l], damping).inverse() * right;
  }
  return x->allFinite();
}

}  // namespace alidade::internal

#include "core/calibration/movement_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/calibration/partial_inverse.h"
#include "core/calibration/zoom_sample.h"
#include "core/model/direction.h"
#include "core/model/median.h"

namespace alidade::internal {
namespace {

constexpr int kPlaces =
    5;  // along the movement, of what distortion and centre have beside the curve
constexpr double kFramesPerSegment = 1.5;
constexpr int kMaxSegments = 300;
constexpr double kLogFSigma = 0.5;  // of the start: what no frame sees stays near the curve
constexpr double kStartSigma_rad = 1e-4;
constexpr double kOutlierSigmas = 4;
constexpr double kLostPixelSquare = 1e6;

int point_row(int control_point) { return 2 * control_point; }

double half_diagonal_of(const MovementData& data) {
  return 0.5 * std::hypot(data.width, data.height);
}

ZoomMotionSpline spline_over(const MovementData& data) {
  const double length = std::max(0.1, data.end_s - data.begin_s);
  const double spacing = std::max(0.01, kFramesPerSegment * data.frame_period_s);
  const int segments = std::clamp(static_cast<int>(std::ceil(length / spacing)), 4, kMaxSegments);
  std::vector<double> knots;
  for (int i = 0; i <= segments; ++i) knots.push_back(data.begin_s + length * i / segments);
  return ZoomMotionSpline(knots);
}

Matrix2<double> damped(Matrix2<double> H, double damping) {
  H.diagonal() *= 1 + damping;
  return H;
}

double robust_weight(double square, double loss) { return 1 / (1 + square / (loss * loss)); }
double robust_square(double square, double loss) {
  return loss * loss * std::log1p(square / (loss * loss));
}

}  // namespace

MovementAdjustment::MovementAdjustment(MovementData data, const ZoomCurve& curve)
    : data_(std::move(data)),
      curve_(curve),
      shared_(curve.content().shared),
      spline_(spline_over(data_)),
      telemetry_sigma_(data_.pan_tilt_sigma_rad > 0 ? data_.pan_tilt_sigma_rad : kStartSigma_rad) {
  for (int i = 0; i < spline_.control_points(); ++i) {
    // What a control point moves begins three knots before it.
    const auto knot = [&](int k) {
      const double spacing = (spline_.end_s() - spline_.begin_s()) / spline_.segments();
      return spline_.begin_s() + k * spacing;
    };
    int unknown = 2 + log_f_unknowns_;
    if (knot(i - 3) < data_.rest_ends_s) {
      unknown = 0;
    } else if (knot(i + 1) > data_.rest_begins_s) {
      unknown = 1;
    } else {
      ++log_f_unknowns_;
    }
    log_f_unknown_.push_back(unknown);
  }
  log_f_unknowns_ += 2;
  set_places();
  unknowns_ = first_beside() + 3 * kPlaces;
  set_start();
  set_landmarks();
}

int MovementAdjustment::log_f_unknown(int control_point) const {
  return first_log_f() + log_f_unknown_[static_cast<std::size_t>(control_point)];
}

void MovementAdjustment::set_places() {
  const auto quantities = [&](double reading, Vector3<double>* sigma) {
    Calibration c;
    if (!curve_.at(reading, &c)) return Vector3<double>(0, 0, 0);
    const double per_corner = per_corner_at(c.camera.focal_length);
    if (sigma != nullptr) {
      *sigma = {parameter_sigma(c, Parameter::kRadialDistortion) / per_corner,
                parameter_sigma(c, Parameter::kCentreU), parameter_sigma(c, Parameter::kCentreV)};
    }
    return Vector3<double>(c.camera.radial_distortion / per_corner, c.camera.centre_u,
                           c.camera.centre_v);
  };
  const double from = data_.passed.front().zoom;
  const double to = data_.passed.back().zoom;
  for (const ZoomReading& reading : data_.passed) {
    way_time_s_.push_back(reading.time_s);
    way_share_.push_back((reading.zoom - from) / (to - from));
    way_quantities_.push_back(quantities(reading.zoom, nullptr));
  }
  beside_ = Eigen::Matrix3Xd::Zero(3, kPlaces);
  beside_sigma_ = Eigen::Matrix3Xd::Zero(3, kPlaces);
  // What is taken as exact stays so, as far as the normal equations can tell.
  const Vector3<double> least(1e-6, 1e-4, 1e-4);
  for (int i = 0; i < kPlaces; ++i) {
    Vector3<double> sigma = Vector3<double>::Zero();
    (void)quantities(from + (to - from) * i / (kPlaces - 1), &sigma);
    beside_sigma_.col(i) = sigma.cwiseMax(least);
  }
}

MovementAdjustment::Passing MovementAdjustment::passing_at(double time_s) const {
  if (time_s < way_time_s_.front()) return {1, 0};
  if (time_s >= way_time_s_.back()) return {way_time_s_.size() - 1, 1};
  const auto after = std::upper_bound(way_time_s_.begin(), way_time_s_.end(), time_s);
  const auto i = static_cast<std::size_t>(after - way_time_s_.begin());
  return {i, (time_s - way_time_s_[i - 1]) / (way_time_s_[i] - way_time_s_[i - 1])};
}

double MovementAdjustment::per_corner_at(double focal_length) const {
  return std::pow(focal_length / half_diagonal_of(data_), 2);
}

Camera<double> MovementAdjustment::camera_at(double log_f, const LensPlace& lens) const {
  Camera<double> camera = shared_.camera;
  camera.focal_length = std::exp(log_f);
  camera.radial_distortion = lens.quantities[0] * per_corner_at(camera.focal_length);
  camera.set_centre_offset(lens.quantities.tail<2>());
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

// Pan and tilt by telemetry, log f by the curve, smoothed a little.
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

// The mean of where the start has each.
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
  const Vector2<double> J_u_log_f =
      camera.focal_length * J_u_camera.col(0) + 2 * camera.radial_distortion * J_u_camera.col(2);
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
  const double per_corner = per_corner_at(camera.focal_length);
  for (const int which : {0, 1}) {
    const double share = which == 0 ? 1 - lens.share : lens.share;
    const int first = first_beside() + 3 * (lens.first + which);
    add(first, share * per_corner * (whiten * J_u_camera.col(2)));
    add(first + 1, share * whiten.col(0));
    add(first + 2, share * whiten.col(1));
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
  for (int i = 0; i < 3 * kPlaces; ++i) {
    const double sigma = beside_sigma_(i % 3, i / 3);
    const double n = beside_(i % 3, i / 3);
    out->cost += n * n / (sigma * sigma);
    if (!with_derivatives) continue;
    const int a = first_beside() + i;
    out->H(a, a) += 1 / (sigma * sigma);
    out->g[a] -= n / (sigma * sigma);
  }
  if (!with_derivatives) return;
  // Nothing is said of where log f is, only that no step goes far.
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

void MovementAdjustment::apply(const Eigen::VectorXd& x,
                               const std::vector<Vector2<double>>& x_landmark) {
  for (int i = 0; i < spline_.control_points(); ++i) {
    spline_.control_point(i) +=
        Vector3<double>(x[point_row(i)], x[point_row(i) + 1], x[log_f_unknown(i)]);
  }
  for (int i = 0; i < 3 * kPlaces; ++i) beside_(i % 3, i / 3) += x[first_beside() + i];
  for (std::size_t l = 0; l < landmarks_.size(); ++l) {
    landmarks_[l] = direction_plus<double>(landmarks_[l], x_landmark[l]).normalized();
  }
}

void MovementAdjustment::minimise(double loss_px, int max_steps, Normal* at) {
  constexpr double kTolerance = 1e-3;  // of cost
  double damping = 1e-6;
  linearise(loss_px, true, at);
  for (int step = 0; step < max_steps; ++step) {
    Eigen::VectorXd x;
    std::vector<Vector2<double>> x_landmark;
    if (!solve(*at, damping, &x, &x_landmark)) {
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    const ZoomMotionSpline spline = spline_;
    const Eigen::Matrix3Xd beside = beside_;
    const std::vector<Vector3<double>> landmarks = landmarks_;
    apply(x, x_landmark);
    Normal next;
    linearise(loss_px, false, &next);
    const double gained = at->cost - next.cost;
    if (!(gained >= 0)) {
      spline_ = spline;
      beside_ = beside;
      landmarks_ = landmarks;
      if (gained > -kTolerance) break;
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    damping = std::max(1e-12, damping / 10);
    linearise(loss_px, true, at);
    if (gained < kTolerance) break;
  }
}

void MovementAdjustment::mark_outliers(const Normal& at) {
  auto& observations = data_.input.observations;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const double square = at.pixel_square[i];
    observations[i].used =
        square >= 0 &&
        square < kOutlierSigmas * kOutlierSigmas * std::max(1.0, std::pow(pixel_sigma_ratio_, 2));
  }
  // What is seen once says nothing.
  std::vector<int> sightings(landmarks_.size(), 0);
  for (const AdjustmentObservation& seen : observations) {
    if (seen.used) ++sightings[static_cast<std::size_t>(seen.landmark)];
  }
  for (AdjustmentObservation& seen : observations) {
    if (sightings[static_cast<std::size_t>(seen.landmark)] < 2) seen.used = false;
  }
}

bool MovementAdjustment::run(std::string* error) {
  // The median of |e|^2 of two unit normals is 2 log 2.
  const double median_square = 2 * std::log(2.0);
  Normal at;
  const auto settle = [&] {
    std::vector<double> squares;
    for (std::size_t i = 0; i < at.pixel_square.size(); ++i) {
      if (at.pixel_square[i] >= 0 && data_.input.observations[i].used)
        squares.push_back(at.pixel_square[i]);
    }
    if (squares.empty()) return false;
    pixel_sigma_ratio_ = std::sqrt(median(std::move(squares)) / median_square);
    if (data_.pan_tilt_sigma_rad <= 0 && at.telemetry_count > 0) {
      telemetry_sigma_ *=
          std::clamp(std::sqrt(at.telemetry_square / at.telemetry_count) * 1.05, 0.2, 5.0);
    }
    return true;
  };
  linearise(std::numeric_limits<double>::infinity(), false, &at);
  for (int round = 0; round < 5; ++round) {
    if (!settle()) {
      *error = "no landmark can be placed";
      return false;
    }
    minimise(3 * std::max(1.0, pixel_sigma_ratio_), 10, &at);
  }
  (void)settle();
  mark_outliers(at);
  minimise(std::numeric_limits<double>::infinity(), 10, &at);

  double square = 0;
  int count = 0;
  std::vector<char> is_used(landmarks_.size(), 0);
  for (std::size_t i = 0; i < at.pixel_square.size(); ++i) {
    const AdjustmentObservation& seen = data_.input.observations[i];
    if (!seen.used || at.pixel_square[i] < 0) continue;
    square += at.pixel_square[i];
    count += 2;
    is_used[static_cast<std::size_t>(seen.landmark)] = 1;
  }
  const auto placed = static_cast<int>(std::count(is_used.begin(), is_used.end(), 1));
  const int freedom = count + at.telemetry_count - 2 * placed - unknowns_;
  if (freedom < unknowns_) {
    *error = "too few tracks agree with one movement";
    return false;
  }
  pixel_sigma_ratio_ = std::sqrt((square + at.telemetry_square) / freedom);
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  if (!reduce(at, 0, &H, &g)) {
    *error = "a landmark is left undetermined";
    return false;
  }
  covariance_ = scaled_inverse(H.selfadjointView<Eigen::Lower>());
  if (covariance_.size() == 0) {
    *error = "the tracks leave the movement undetermined";
    return false;
  }
  covariance_ *= std::max(1.0, std::pow(pixel_sigma_ratio_, 2));
  return true;
}

Eigen::VectorXd MovementAdjustment::log_f_row(double time_s) const {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns_);
  const ZoomMotionSpline::Basis at = basis(time_s);
  for (int i = 0; i < 4; ++i) row[log_f_unknown(at.segment + i)] += at.weight[i];
  return row;
}

}  // namespace alidade::internal

#include "edge_app/verify/known_directions.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/calibration/chance.h"
#include "core/model/angle.h"
#include "core/model/rolling_shutter.h"
#include "core/model/rotation.h"
#include "edge_app/verify/covariance_root.h"
#include "platform/storage/csv_reader.h"

namespace alidade {
namespace {

constexpr double kRadians = kPi / 180;
constexpr double kLeastPart = 1e-6;  // of the turn's best known axis, in variance; less is unknown

// A direction as seen, in the platform frame, and how errors of unit variance move it.
struct Seen {
  const FrameOrientation* frame = nullptr;
  KnownDirection known;
  Vector3<double> direction;
  Matrix<double, 3, 4> of_motion;
  Matrix<double, 3, kParameterCount> of_parameters;
};

bool see(const FrameOrientation& frame, const KnownDirection& known, Seen* out) {
  Matrix<double, 3, 4> J_motion;
  Matrix<double, 3, kParameterCount> J_parameters;
  if (frame.mode == OrientationMode::kNone ||
      rolling_shutter_unproject(frame.calibration.camera, frame.calibration.mechanics,
                                frame.calibration.line_delay, frame.motion(), known.pixel,
                                &out->direction, nullptr, &J_motion,
                                &J_parameters) != ProjectionStatus::kOk) {
    return false;
  }
  out->frame = &frame;
  out->known = known;
  out->of_motion = J_motion * covariance_root(frame.motion_covariance.topLeftCorner<4, 4>());
  out->of_parameters = (J_parameters + J_motion * frame.motion_sensitivity.topRows<4>()) *
                       covariance_root(frame.calibration.covariance);
  return true;
}

double azimuth_of(const Vector3<double>& d) { return std::atan2(d.y(), d.x()); }
double elevation_of(const Vector3<double>& d) { return std::atan2(-d.z(), d.head<2>().norm()); }

Vector3<double> direction_at(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          -std::sin(elevation)};
}

// Right and up at a direction, as seen from inside.
Matrix<double, 2, 3> sides_at(const Vector3<double>& d) {
  const double azimuth = azimuth_of(d);
  const double elevation = elevation_of(d);
  Matrix<double, 2, 3> out;
  out << -std::sin(azimuth), std::cos(azimuth), 0, -std::sin(elevation) * std::cos(azimuth),
      -std::sin(elevation) * std::sin(azimuth), -std::cos(elevation);
  return out;
}

// The angle from `from` to `to`, to the right and up.
Vector2<double> angles_between(const Vector3<double>& from, const Vector3<double>& to) {
  const Vector2<double> across = sides_at(from) * to;
  const double sine = across.norm();
  const double angle = std::atan2(sine, from.dot(to));
  if (sine > 0) return angle / sine * across;
  return {angle, 0};
}

// The turn by roll, pitch and heading.
Matrix3<double> turn_by(const Vector3<double>& angles) {
  return rotation_about<double>(Vector3<double>::UnitZ(), angles.z()) *
         rotation_about<double>(Vector3<double>::UnitY(), angles.y()) *
         rotation_about<double>(Vector3<double>::UnitX(), angles.x());
}

// The axes about which each of the angles turns a direction that is turned already.
Matrix3<double> axes_of(const Vector3<double>& angles) {
  Matrix3<double> out;
  out.col(0) = turn_by(angles) * Vector3<double>::UnitX();
  out.col(1) = turn_by({0, 0, angles.z()}) * Vector3<double>::UnitY();
  out.col(2) = Vector3<double>::UnitZ();
  return out;
}

// Rows of one direction under a turn: one or two.
struct Rows {
  Matrix<double, 2, 3> sides;
  Vector2<double> r = Vector2<double>::Zero();
  Matrix2<double> covariance;  // C's block; of a horizon only its last number counts
  int first = 0;               // of the two
};

Rows rows_of(const Seen& seen, const Matrix3<double>& turn) {
  const Vector3<double> d = turn * seen.direction;
  Rows out;
  out.sides = sides_at(d);
  if (seen.known.azimuth) {
    out.r = angles_between(d, direction_at(*seen.known.azimuth, seen.known.elevation));
  } else {
    out.r.y() = seen.known.elevation - elevation_of(d);
    out.first = 1;
  }
  const Matrix<double, 2, 3> sides = out.sides * turn;
  const Matrix<double, 2, 4> by_motion = sides * seen.of_motion;
  const Matrix<double, 2, kParameterCount> by_parameters = sides * seen.of_parameters;
  out.covariance = by_motion * by_motion.transpose() + by_parameters * by_parameters.transpose() +
                   seen.known.sigma * seen.known.sigma * Matrix2<double>::Identity();
  return out;
}

// All rows one below the other, whitened direction by direction; then one for each axis of the turn
// that is stated with a sigma.
struct Stacked {
  Eigen::VectorXd r;
  Eigen::MatrixXd of_motion, of_parameters, of_turn, stated;
  std::vector<const Seen*> seen;  // of each row; null: of the turn
};

Stacked stack(const std::vector<Seen>& all, const Vector3<double>& turned,
              const Vector3<double>& sigma) {
  const Matrix3<double> turn = turn_by(turned);
  const Matrix3<double> axes = axes_of(turned);
  Eigen::Index n = 0;
  for (const Seen& each : all) n += each.known.azimuth ? 2 : 1;
  for (int axis = 0; axis < 3; ++axis) n += sigma[axis] > 0 && std::isfinite(sigma[axis]) ? 1 : 0;
  Stacked out{Eigen::VectorXd(n),
              Eigen::MatrixXd::Zero(n, 4),
              Eigen::MatrixXd::Zero(n, kParameterCount),
              Eigen::MatrixXd::Zero(n, 3),
              Eigen::MatrixXd::Zero(n, n),
              {}};
  Eigen::Index at = 0;
  for (const Seen& each : all) {
    const Rows rows = rows_of(each, turn);
    const int count = 2 - rows.first;
    const Eigen::MatrixXd L = rows.covariance.bottomRightCorner(count, count).llt().matrixL();
    const Eigen::MatrixXd whiten = L.inverse();
    const Eigen::MatrixXd sides = whiten * rows.sides.bottomRows(count);
    out.r.segment(at, count) = whiten * rows.r.tail(count);
    out.of_motion.middleRows(at, count) = sides * turn * each.of_motion;
    out.of_parameters.middleRows(at, count) = sides * turn * each.of_parameters;
    out.of_turn.middleRows(at, count) =
        -sides * skew(Vector3<double>(turn * each.direction)) * axes;
    out.stated.block(at, at, count, count) =
        each.known.sigma * each.known.sigma * whiten * whiten.transpose();
    out.seen.insert(out.seen.end(), static_cast<std::size_t>(count), &each);
    at += count;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(sigma[axis] > 0 && std::isfinite(sigma[axis]))) continue;
    out.r[at] = -turned[axis] / sigma[axis];
    out.of_turn(at, axis) = 1 / sigma[axis];
    out.stated(at, at) = 1;
    out.seen.push_back(nullptr);
    ++at;
  }
  return out;
}

// The rows' covariance. alike: all frames have the same errors, and all zooms; else only the rows
// of one frame, and of one zoom.
Eigen::MatrixXd covariance_of(const Stacked& all, bool alike) {
  Eigen::MatrixXd of_motion = all.of_motion * all.of_motion.transpose();
  Eigen::MatrixXd of_parameters = all.of_parameters * all.of_parameters.transpose();
  const Eigen::Index n = alike ? 0 : all.r.size();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Seen* a = all.seen[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j) {
      const Seen* b = all.seen[static_cast<std::size_t>(j)];
      if (a == nullptr || b == nullptr) continue;
      if (a->known.frame != b->known.frame) of_motion(i, j) = 0;
      if (!is_same_zoom(*a->frame, *b->frame)) of_parameters(i, j) = 0;
    }
  }
  return of_motion + of_parameters + all.stated;
}

// The turn's axes that are estimated, and how rows of covariance I give them: H r.
struct TurnFit {
  std::vector<int> axes;
  Eigen::MatrixXd T, H;
};

// False: the rows do not tell them.
bool fit_turn(const Stacked& all, const Vector3<double>& sigma, TurnFit* out) {
  const double most = all.of_turn.colwise().squaredNorm().maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    // No horizon depends on the heading.
    if (sigma[axis] > 0 && all.of_turn.col(axis).squaredNorm() > kLeastPart * kLeastPart * most)
      out->axes.push_back(axis);
  }
  const auto count = static_cast<Eigen::Index>(out->axes.size());
  out->T.resize(all.r.size(), count);
  for (Eigen::Index i = 0; i < count; ++i)
    out->T.col(i) = all.of_turn.col(out->axes[static_cast<std::size_t>(i)]);
  out->H.resize(count, all.r.size());
  if (all.r.size() <= count) return false;
  if (count == 0) return true;
  const Eigen::MatrixXd normal = out->T.transpose() * out->T;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(normal);
  if (!(solver.eigenvalues()[0] > kLeastPart * solver.eigenvalues()[count - 1])) return false;
  out->H = normal.ldlt().solve(out->T.transpose());
  return true;
}

void judge(const Stacked& all, const TurnFit& fit, KnownResult* out) {
  const auto without_turn = [&fit](const Eigen::MatrixXd& covariance) {
    const Eigen::MatrixXd left = covariance - fit.T * (fit.H * covariance);
    return Eigen::MatrixXd(left - (left * fit.H.transpose()) * fit.T.transpose());
  };
  const Eigen::VectorXd r = all.r - fit.T * (fit.H * all.r);
  double trace = 0;
  out->freedom = static_cast<double>(all.r.size());
  for (const bool alike : {false, true}) {
    const Eigen::MatrixXd covariance = covariance_of(all, alike);
    const Eigen::MatrixXd left = without_turn(covariance);
    trace = std::max(trace, left.trace());
    out->freedom = std::min(out->freedom, left.trace() * left.trace() / left.squaredNorm());
    const Eigen::MatrixXd of_turn = fit.H * covariance * fit.H.transpose();
    for (std::size_t i = 0; i < fit.axes.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      double& sigma = out->turn_sigma[fit.axes[i]];
      sigma = std::max(sigma, std::sqrt(of_turn(at, at)));
    }
  }
  out->ratio = r.norm() / std::sqrt(trace);
  out->log_chance = internal::log_chance(out->freedom * out->ratio * out->ratio, out->freedom);
  out->share = std::max(0.0, 1 - without_turn(all.stated).trace() / trace);
}

// The heading that all azimuths have in common, however large.
double common_heading(const std::vector<Seen>& all) {
  Vector2<double> sum = Vector2<double>::Zero();
  for (const Seen& each : all) {
    if (!each.known.azimuth) continue;
    const double heading = *each.known.azimuth - azimuth_of(each.direction);
    const double weight = each.direction.head<2>().squaredNorm();
    sum += weight * Vector2<double>(std::cos(heading), std::sin(heading));
  }
  return sum.isZero() ? 0 : std::atan2(sum.y(), sum.x());
}

KnownOffset offset_of(const Seen& seen, const Matrix3<double>& turn) {
  constexpr double kStep_rad = 1e-6;
  const Rows rows = rows_of(seen, turn);
  const int count = 2 - rows.first;
  KnownOffset out;
  out.known = seen.known;
  out.off = rows.r;
  out.sigma.tail(count) = rows.covariance.diagonal().tail(count).cwiseSqrt();
  const Eigen::VectorXd r = rows.r.tail(count);
  out.sigmas =
      std::sqrt(r.dot(rows.covariance.bottomRightCorner(count, count).llt().solve(r)) / count);
  const Vector3<double> d = turn * seen.direction;
  Vector2<double> pixel;
  Matrix2<double> px_per_rad = Matrix2<double>::Zero();
  for (int i = rows.first; i < 2; ++i) {
    const Vector3<double> moved = d + kStep_rad * rows.sides.row(i).transpose();
    if (seen.frame->pixel(turn.transpose() * moved, &pixel) == ProjectionStatus::kOk)
      px_per_rad.col(i) = (pixel - seen.known.pixel) / kStep_rad;
  }
  const Vector3<double> there =
      direction_at(seen.known.azimuth.value_or(azimuth_of(d)), seen.known.elevation);
  const bool has_pixel =
      seen.frame->pixel(turn.transpose() * there, &pixel) == ProjectionStatus::kOk;
  out.off_px = has_pixel ? Vector2<double>(pixel - seen.known.pixel) : px_per_rad * rows.r;
  out.claimed_px = std::sqrt((px_per_rad * rows.covariance * px_per_rad.transpose()).trace());
  return out;
}

}  // namespace

bool read_known_directions(const std::string& path, const KnownLimits& limits,
                           std::vector<KnownDirection>* out, std::string* error) {
  const std::vector<CsvColumn> columns = {
      {"frame", true, true},         {"u_px", true, false},          {"v_px", true, false},
      {"azimuth_deg", false, false}, {"elevation_deg", true, false}, {"sigma_deg", true, false}};
  out->clear();
  const auto add = [&](const CsvCells& cells) -> std::string {
    KnownDirection known;
    known.frame = static_cast<std::int64_t>(*cells[0]);
    known.pixel = {*cells[1], *cells[2]};
    if (cells[3]) known.azimuth = kRadians * *cells[3];
    known.elevation = kRadians * *cells[4];
    known.sigma = kRadians * *cells[5];
    if (!std::binary_search(limits.frames.begin(), limits.frames.end(), known.frame)) {
      return fmt::format("frame {} is not in the recording{}", known.frame,
                         limits.frames.empty()
                             ? ""
                             : fmt::format(", whose frames are {} to {}", limits.frames.front(),
                                           limits.frames.back()));
    }
    const bool inside = known.pixel.x() >= 0 && known.pixel.x() <= limits.width &&
                        known.pixel.y() >= 0 && known.pixel.y() <= limits.height;
    if (!inside) {
      return fmt::format("pixel ({:g}, {:g}) is outside the pictures of {}x{} px", known.pixel.x(),
                         known.pixel.y(), limits.width, limits.height);
    }
    if (cells[3] && std::abs(*cells[3]) > 360)
      return fmt::format("azimuth_deg {:g} must be from -360 to 360", *cells[3]);
    if (std::abs(*cells[4]) > 90)
      return fmt::format("elevation_deg {:g} must be from -90 to 90", *cells[4]);
    if (!(*cells[5] > 0 && *cells[5] <= 10))
      return fmt::format("sigma_deg {:g} must be above 0, up to 10", *cells[5]);
    if (out->size() == kMostKnownDirections) {
      return fmt::format("more than {} directions; give those that lie farthest apart",
                         kMostKnownDirections);
    }
    out->push_back(known);
    return "";
  };
  if (!read_csv(path, columns, add, error)) return false;
  if (!out->empty()) return true;
  *error = path + ": has no row; give frame,u_px,v_px,azimuth_deg,elevation_deg,sigma_deg";
  return false;
}

KnownResult check_known(const std::vector<KnownSight>& sights, OrientationFrom from,
                        const TurnSigma& turn_sigma) {
  constexpr int kMostSteps = 20;
  constexpr double kSmallStep_rad = 1e-10;
  KnownResult out;
  std::vector<Seen> all;
  for (const KnownSight& sight : sights) {
    Seen seen;
    const bool by_landmarks = from == OrientationFrom::kLandmarks;
    if (see(by_landmarks ? sight.by_landmarks : sight.by_telemetry, sight.known, &seen))
      all.push_back(seen);
  }
  if (all.empty()) return out;
  const Vector3<double> sigma(turn_sigma.level, turn_sigma.level, turn_sigma.heading);
  Vector3<double> turned(0, 0, std::isinf(turn_sigma.heading) ? common_heading(all) : 0);
  Stacked stacked;
  TurnFit fit;
  for (int step = 0; step < kMostSteps; ++step) {
    stacked = stack(all, turned, sigma);
    fit = {};
    out.is_determined = fit_turn(stacked, sigma, &fit);
    if (!out.is_determined || fit.axes.empty()) break;
    const Eigen::VectorXd by_rows = fit.H * stacked.r;
    if (by_rows.norm() < kSmallStep_rad) break;
    for (std::size_t i = 0; i < fit.axes.size(); ++i)
      turned[fit.axes[i]] += by_rows[static_cast<Eigen::Index>(i)];
  }
  const Matrix3<double> turn = turn_by(turned);
  for (const Seen& each : all) {
    out.numbers += each.known.azimuth ? 2 : 1;
    out.offsets.push_back(offset_of(each, turn));
    out.rms += out.offsets.back().off.squaredNorm();
    out.rms_px += out.offsets.back().off_px.squaredNorm();
    out.claimed_px += out.offsets.back().claimed_px * out.offsets.back().claimed_px;
  }
  const auto count = static_cast<double>(all.size());
  out.rms = std::sqrt(out.rms / out.numbers);
  out.rms_px = std::sqrt(out.rms_px / count);
  out.claimed_px = std::sqrt(out.claimed_px / count);
  if (!out.is_determined) return out;
  out.turn = {turned.x(), turned.y(), wrap_angle(turned.z())};
  judge(stacked, fit, &out);
  return out;
}

}  // namespace alidade

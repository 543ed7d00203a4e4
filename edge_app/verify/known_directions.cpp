#include "edge_app/verify/known_directions.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/calibration/chance.h"
#include "core/model/angle.h"
#include "core/model/rolling_shutter.h"
#include "platform/storage/csv_reader.h"

namespace alidade {
namespace {

constexpr double kRadians = kPi / 180;
constexpr double kLeastCos = 1e-3;  // of an elevation at which azimuth still means something

// Square root of a covariance, of a fixed sign: roots of neighbouring frames are alike.
Matrix4<double> root_of(const Matrix4<double>& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix4<double>> solver(covariance);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

// What one known direction gives: one row or two.
struct Rows {
  Eigen::VectorXd r;
  Eigen::MatrixXd of_motion;      // times the root of the frame's covariance
  Eigen::MatrixXd of_parameters;  // rad
  Eigen::MatrixXd of_turn;
  double stated = 0;  // rad^2
};

bool linearise(const FrameOrientation& frame, const KnownDirection& known, Rows* out) {
  Vector3<double> d;
  Matrix<double, 3, 4> J_motion;
  Matrix<double, 3, kParameterCount> J_parameters;
  if (rolling_shutter_unproject(frame.calibration.camera, frame.calibration.mechanics,
                                frame.calibration.line_delay, frame.motion(), known.pixel, &d,
                                nullptr, &J_motion, &J_parameters) != ProjectionStatus::kOk) {
    return false;
  }
  const double azimuth = std::atan2(d.y(), d.x());
  const double elevation = std::atan2(-d.z(), d.head<2>().norm());
  const double cos_elevation = std::cos(elevation);
  Matrix<double, 2, 3> sides;  // right and up, as seen from inside
  sides.row(0) << -std::sin(azimuth), std::cos(azimuth), 0;
  sides.row(1) << -std::sin(elevation) * std::cos(azimuth),
      -std::sin(elevation) * std::sin(azimuth), -cos_elevation;
  Vector2<double> r(0, known.elevation - elevation);
  int first = 1;
  if (known.azimuth && cos_elevation > kLeastCos) {
    r[0] = cos_elevation * wrap_angle(*known.azimuth - azimuth);
    first = 0;
  }
  const int n = 2 - first;
  const Matrix<double, 3, kParameterCount> P =
      J_parameters + J_motion * frame.motion_sensitivity.topRows<4>();
  Matrix<double, 2, 3> turn;
  for (int i = 0; i < 2; ++i) turn.row(i) = d.cross(Vector3<double>(sides.row(i))).transpose();
  out->r = r.tail(n);
  out->of_motion =
      (sides * J_motion * root_of(Matrix4<double>(frame.motion_covariance.topLeftCorner<4, 4>())))
          .bottomRows(n);
  out->of_parameters = (sides * P).bottomRows(n);
  out->of_turn = turn.bottomRows(n);
  out->stated = known.sigma * known.sigma;
  return true;
}

// All rows one below the other.
struct Stacked {
  Eigen::VectorXd r;
  Eigen::MatrixXd C, W, of_turn;
};

Stacked stack(const std::vector<Rows>& rows, const ParameterCovariance<double>& parameters) {
  Eigen::Index n = 0;
  for (const Rows& each : rows) n += each.r.size();
  Stacked out{Eigen::VectorXd(n), Eigen::MatrixXd(n, n), Eigen::MatrixXd::Zero(n, n),
              Eigen::MatrixXd(n, 3)};
  Eigen::MatrixXd motion(n, 4);
  Eigen::MatrixXd P(n, kParameterCount);
  Eigen::VectorXd stated(n);
  Eigen::Index at = 0;
  for (const Rows& each : rows) {
    const Eigen::Index count = each.r.size();
    out.r.segment(at, count) = each.r;
    motion.middleRows(at, count) = each.of_motion;
    P.middleRows(at, count) = each.of_parameters;
    out.of_turn.middleRows(at, count) = each.of_turn;
    stated.segment(at, count).setConstant(each.stated);
    at += count;
  }
  out.C = motion * motion.transpose() + P * parameters * P.transpose();
  out.C += stated.asDiagonal();
  at = 0;
  for (const Rows& each : rows) {
    const Eigen::Index count = each.r.size();
    out.W.block(at, at, count, count) = out.C.block(at, at, count, count).inverse();
    at += count;
  }
  return out;
}

struct Judged {
  double freedom = 0, ratio = 0, log_chance = 0;
};

// r^T W r, if r has the covariance C (Satterthwaite).
Judged judge(const Eigen::VectorXd& r, const Eigen::MatrixXd& W, const Eigen::MatrixXd& C) {
  const Eigen::MatrixXd WC = W * C;
  const double mean = WC.trace();
  Judged out;
  out.freedom = mean * mean / (WC * WC).trace();
  out.ratio = std::sqrt(std::max(0.0, r.dot(W * r)) / mean);
  out.log_chance = internal::log_chance(out.freedom * out.ratio * out.ratio, out.freedom);
  return out;
}

void fit_turn(const Stacked& all, KnownResult* result) {
  constexpr Eigen::Index kLeastNumbers = 5;
  constexpr double kLeastPart = 1e-6;  // of the best seen axis
  if (all.r.size() < kLeastNumbers) return;
  const Matrix3<double> normal = all.of_turn.transpose() * all.W * all.of_turn;
  const Eigen::SelfAdjointEigenSolver<Matrix3<double>> solver(normal);
  if (!(solver.eigenvalues()[0] > kLeastPart * solver.eigenvalues()[2])) return;
  const Eigen::MatrixXd H = normal.inverse() * all.of_turn.transpose() * all.W;
  const auto n = all.r.size();
  const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(n, n) - all.of_turn * H;
  const Judged judged = judge(left * all.r, all.W, left * all.C * left.transpose());
  result->has_turn = true;
  result->turn = H * all.r;
  result->turn_sigma = (H * all.C * H.transpose()).diagonal().cwiseSqrt();
  result->ratio_turned = judged.ratio;
  result->log_chance_turned = judged.log_chance;
}

}  // namespace

bool read_known_directions(const std::string& path, int width, int height,
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
    const bool inside = known.pixel.x() >= 0 && known.pixel.x() <= width && known.pixel.y() >= 0 &&
                        known.pixel.y() <= height;
    if (!inside)
      return fmt::format("pixel ({:g}, {:g}) is outside the pictures of {}x{} px", known.pixel.x(),
                         known.pixel.y(), width, height);
    if (std::abs(*cells[4]) > 90)
      return fmt::format("elevation_deg {:g} must be from -90 to 90", *cells[4]);
    if (!(known.sigma > 0)) return fmt::format("sigma_deg {:g} must be above 0", *cells[5]);
    out->push_back(known);
    return "";
  };
  if (!read_csv(path, columns, add, error)) return false;
  if (!out->empty()) return true;
  *error = path + ": has no row; give frame,u_px,v_px,azimuth_deg,elevation_deg,sigma_deg";
  return false;
}

KnownResult check_known(const std::vector<KnownSight>& sights, OrientationFrom from,
                        const ParameterCovariance<double>& parameters) {
  KnownResult out;
  std::vector<Rows> rows;
  for (const KnownSight& sight : sights) {
    const FrameOrientation& frame =
        from == OrientationFrom::kLandmarks ? sight.by_landmarks : sight.by_telemetry;
    Rows row;
    if (frame.mode == OrientationMode::kNone || !linearise(frame, sight.known, &row)) continue;
    rows.push_back(row);
    out.offsets.push_back({sight.known, {}, {}});
  }
  if (rows.empty()) return out;
  const Stacked all = stack(rows, parameters);
  const Judged judged = judge(all.r, all.W, all.C);
  out.numbers = static_cast<int>(all.r.size());
  out.freedom = judged.freedom;
  out.ratio = judged.ratio;
  out.log_chance = judged.log_chance;
  out.rms = std::sqrt(all.r.squaredNorm() / out.numbers);
  Eigen::Index at = 0;
  double stated = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Index n = rows[i].r.size();
    out.offsets[i].off.tail(n) = rows[i].r;
    out.offsets[i].sigma.tail(n) = all.C.diagonal().segment(at, n).cwiseSqrt();
    stated += rows[i].stated * all.W.diagonal().segment(at, n).sum();
    at += n;
  }
  out.share = std::max(0.0, 1 - stated / out.numbers);
  fit_turn(all, &out);
  return out;
}

}  // namespace alidade

#include "test/accuracy/zoom_comparison.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>

#include "core/model/rolling_shutter.h"
#include "core/realtime/pt_mode.h"

namespace alidade::test {
namespace {

constexpr double kAgrees_px = 2;

// What a camera knows of a frame's lens beside its focal length.
Camera<double> told_camera(const ZoomingCamera& camera, int k) {
  return camera.lens(k, 0).calibration.camera;
}

double true_focal_length(const ZoomingCamera& camera, int k) {
  return camera.camera().lens_at(camera.middle_s(k)).focal_length;
}

}  // namespace

std::optional<TurnAndZoom> turn_and_zoom(const Matrix3<double>& H, double focal_length_a,
                                         const std::vector<Vector2<double>>& points_a) {
  constexpr int kSteps = 10;
  Matrix3<double> M = H;
  M.leftCols<2>() *= focal_length_a;
  if (!all_finite(M) || !(M.determinant() != 0)) return std::nullopt;
  if (M.determinant() < 0) M = -M;
  TurnAndZoom out;
  out.focal_length_b = std::sqrt(M.row(0).norm() * M.row(1).norm()) / M.row(2).norm();
  M.topRows<2>() /= out.focal_length_b;
  const Eigen::JacobiSVD<Matrix3<double>> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  out.R_b_from_a = svd.matrixU() * svd.matrixV().transpose();
  for (int step = 0; step < kSteps; ++step) {
    Matrix4<double> N = Matrix4<double>::Zero();
    Vector4<double> b = Vector4<double>::Zero();
    for (const Vector2<double>& point : points_a) {
      const Vector2<double> wanted = (H * point.homogeneous()).hnormalized();
      const Vector3<double> d = out.R_b_from_a * Vector3<double>(point.x() / focal_length_a,
                                                                 point.y() / focal_length_a, 1);
      const Vector2<double> seen = out.focal_length_b * d.hnormalized();
      Matrix<double, 2, 3> J_d;
      J_d << out.focal_length_b, 0, -seen.x(), 0, out.focal_length_b, -seen.y();
      Matrix<double, 2, 4> J;  // of a turn, R <- Exp(turn) R, and of log f
      J << -J_d / d.z() * skew(d), seen;
      N += J.transpose() * J;
      b += J.transpose() * (wanted - seen);
    }
    const Vector4<double> change = N.ldlt().solve(b);
    if (!all_finite(change)) return std::nullopt;
    const Vector3<double> turn = change.head<3>();
    if (turn.norm() > 0) {
      out.R_b_from_a = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * out.R_b_from_a;
    }
    out.focal_length_b *= std::exp(change[3]);
  }
  return out;
}

ZoomAnswer answer_of(const FrameOrientation& frame) {
  const Calibration& calibration = frame.calibration;
  const double middle = 0.5 * calibration.camera.height;
  ZoomAnswer out;
  out.focal_length =
      camera_at_row(calibration.camera, frame.motion(), calibration.line_delay, middle)
          .focal_length;
  out.R_base_from_camera = R_base_from_camera(
      calibration.mechanics, angle_at_row(frame.motion(), calibration.line_delay, middle));
  out.direction = [frame](const Vector2<double>& u) {
    Vector3<double> d;
    EXPECT_EQ(frame.direction(u, &d), ProjectionStatus::kOk);
    return d;
  };
  return out;
}

ZoomAnswerErrors errors_of(const ZoomingCamera& camera, int k, const ZoomAnswer& answer) {
  constexpr int kColumns = 9;
  constexpr int kRows = 7;
  const Camera<double> told = told_camera(camera, k);
  const Matrix3<double> truth = camera.camera().base_from_camera_at(camera.middle_s(k));
  ZoomAnswerErrors out;
  out.log_focal_length = std::log(answer.focal_length / true_focal_length(camera, k));
  out.rotation_rad =
      Eigen::AngleAxisd(Matrix3<double>(truth.transpose() * answer.R_base_from_camera)).angle();
  double squares = 0;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vector2<double> u((0.02 + 0.96 * column / (kColumns - 1)) * told.width,
                              (0.02 + 0.96 * row / (kRows - 1)) * told.height);
      const double time_s = camera.time_s(k) + camera.line_delay() * u.y();
      const Vector2<double> slope = camera.camera().slope_at(u.x(), u.y(), time_s);
      const Vector3<double> d =
          camera.camera().base_from_camera_at(time_s) * slope.homogeneous().normalized();
      squares += (answer.direction(u).normalized() - d).squaredNorm();
    }
  }
  out.px = true_focal_length(camera, k) * std::sqrt(squares / (kColumns * kRows));
  return out;
}

NearestNodes::NearestNodes(const ZoomingCamera& camera, double wide, double tele, int nodes,
                           const Mechanics<double>& mechanics)
    : camera_(camera) {
  for (int i = 0; i < nodes; ++i) {
    const double f = wide * std::pow(tele / wide, static_cast<double>(i) / (nodes - 1));
    nodes_.push_back(camera.curve_of(camera.reading_of(f), 0));
    nodes_.back().mechanics = mechanics;
  }
}

std::optional<ZoomAnswer> NearestNodes::answer(int k, const InterpolatedPanTilt& telemetry) const {
  const double told = told_camera(camera_, k).focal_length;
  const auto distance = [told](const Calibration& node) {
    return std::abs(std::log(node.camera.focal_length / told));
  };
  const auto nearest = std::min_element(
      nodes_.begin(), nodes_.end(),
      [&](const Calibration& a, const Calibration& b) { return distance(a) < distance(b); });
  FrameOrientation frame;
  if (!pt_orientation(*nearest, camera_.time_s(k), telemetry, &frame)) return std::nullopt;
  return answer_of(frame);
}

KeyframeHomographies::KeyframeHomographies(const ZoomingCamera& camera,
                                           const std::vector<cv::Mat>& film, int frames_between)
    : camera_(camera), film_(film), frames_between_(frames_between) {
  for (int k = 0; k < camera.frames(); k += frames_between) keyframes_.push_back(features_of(k));
}

PlacedFeatures KeyframeHomographies::features_of(int k) const {
  constexpr int kMost = 1500;
  constexpr float kHalf = 0.5F;  // OpenCV's pixel centres are at whole numbers
  std::vector<cv::KeyPoint> points;
  PlacedFeatures out;
  cv::SIFT::create(kMost)->detectAndCompute(film_[static_cast<std::size_t>(k)], cv::noArray(),
                                            points, out.descriptors);
  const Camera<double> camera = told_camera(camera_, k);
  for (const cv::KeyPoint& point : points) {
    Vector3<double> d;
    EXPECT_EQ(unproject(camera, Vector2<double>(point.pt.x + kHalf, point.pt.y + kHalf), &d),
              ProjectionStatus::kOk);
    const Vector2<double> pinhole = camera.focal_length * d.hnormalized();
    out.points.emplace_back(static_cast<float>(pinhole.x()), static_cast<float>(pinhole.y()));
  }
  return out;
}

std::optional<ZoomAnswer> KeyframeHomographies::answer(int k) const {
  const simulator::Angles at = camera_.angles_at(camera_.middle_s(k));
  const double f = told_camera(camera_, k).focal_length;
  int nearest = -1;
  double least = 0;
  for (int i = 0; i < static_cast<int>(keyframes_.size()); ++i) {
    const int key = i * frames_between_;
    if (key == k) continue;
    const simulator::Angles there = camera_.angles_at(camera_.middle_s(key));
    const double fields = f / told_camera(camera_, key).width;
    const double distance =
        std::hypot(fields * (there.pan - at.pan), fields * (there.tilt - at.tilt),
                   std::log(told_camera(camera_, key).focal_length / f));
    if (nearest >= 0 && distance >= least) continue;
    nearest = i;
    least = distance;
  }
  if (nearest < 0) return std::nullopt;
  const PlacedFeatures& keyframe = keyframes_[static_cast<std::size_t>(nearest)];
  const PlacedFeatures own = features_of(k);
  const auto found = match_homography(keyframe, own, kAgrees_px);
  if (!found) return std::nullopt;
  const int key = nearest * frames_between_;
  const auto solved = turn_and_zoom(found->H, true_focal_length(camera_, key), found->agreeing);
  if (!solved) return std::nullopt;
  ZoomAnswer out;
  out.focal_length = solved->focal_length_b;
  out.R_base_from_camera =
      camera_.camera().base_from_camera_at(camera_.middle_s(key)) * solved->R_b_from_a.transpose();
  const Camera<double> camera = zoomed(told_camera(camera_, k), std::log(out.focal_length / f));
  out.direction = [camera,
                   R = out.R_base_from_camera](const Vector2<double>& u) -> Vector3<double> {
    Vector3<double> d;
    EXPECT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk);
    return R * d;
  };
  return out;
}

}  // namespace alidade::test

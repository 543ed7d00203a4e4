#include "core/pattern/pattern_start.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/calib3d.hpp>

namespace alidade::internal {
namespace {

// Fewer observations give no reliable pose.
constexpr std::size_t kLeastPoints = 6;

// OpenCV has the centre of the top-left pixel at (0, 0).
cv::Point2d to_opencv(const Vector2<double>& u) { return {u.x() - 0.5, u.y() - 0.5}; }

void points_of(const PatternData& data, const PatternFrame& frame, std::vector<cv::Point3f>* points,
               std::vector<cv::Point2f>* pixels) {
  for (const PatternObservation& observation : frame.observations) {
    const Vector3<double>& p = data.points_m[static_cast<std::size_t>(observation.point)];
    points->emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                         static_cast<float>(p.z()));
    pixels->push_back(to_opencv(observation.u));
  }
}

// Mean motion of the points that two frames share, px/s; empty if they share none.
std::optional<double> speed_between(const PatternFrame& a, const PatternFrame& b) {
  double sum = 0;
  int count = 0;
  std::size_t j = 0;
  for (const PatternObservation& of_a : a.observations) {
    while (j < b.observations.size() && b.observations[j].point < of_a.point) ++j;
    if (j == b.observations.size()) break;
    if (b.observations[j].point != of_a.point) continue;
    sum += (b.observations[j].u - of_a.u).norm();
    ++count;
  }
  if (count == 0 || b.time_s <= a.time_s) return std::nullopt;
  return sum / count / (b.time_s - a.time_s);
}

// The slowest frame of each of kViews intervals: views that are still and differ from one another.
std::vector<std::size_t> slow_views(const PatternData& data) {
  constexpr std::size_t kViews = 24;
  std::vector<std::size_t> chosen;
  const std::size_t count = data.frames.size();
  for (std::size_t view = 0; view < kViews; ++view) {
    std::size_t best = count;
    double slowest = 0;
    std::size_t most = 0;
    for (std::size_t f = view * count / kViews; f < (view + 1) * count / kViews; ++f) {
      const PatternFrame& frame = data.frames[f];
      if (frame.observations.size() < kLeastPoints) continue;
      std::size_t next = f + 1;
      while (next < count && data.frames[next].observations.empty()) ++next;
      if (next >= count) continue;
      const std::optional<double> speed = speed_between(frame, data.frames[next]);
      if (!speed) continue;
      // A frame with more of the pattern is preferred, even if it moves.
      const std::size_t seen = frame.observations.size();
      if (best == count || 10 * seen > 11 * most || (11 * seen > 10 * most && *speed < slowest)) {
        best = f;
        slowest = *speed;
        most = seen;
      }
    }
    if (best < count) chosen.push_back(best);
  }
  return chosen;
}

cv::Matx33d camera_matrix(const LensVector& lens) {
  return {lens[index(LensParameter::kFocalLengthU)],
          0,
          lens[index(LensParameter::kCentreU)] - 0.5,
          0,
          lens[index(LensParameter::kFocalLengthV)],
          lens[index(LensParameter::kCentreV)] - 0.5,
          0,
          0,
          1};
}

cv::Vec4d distortion(const LensVector& lens) {
  return {lens[index(LensParameter::kK1)], lens[index(LensParameter::kK2)],
          lens[index(LensParameter::kP1)], lens[index(LensParameter::kP2)]};
}

}  // namespace

std::optional<LensVector> start_lens(const PatternData& data, const LensKnowledge& knowledge) {
  const std::vector<std::size_t> views = slow_views(data);
  if (views.size() < 3) return std::nullopt;
  std::vector<std::vector<cv::Point3f>> points(views.size());
  std::vector<std::vector<cv::Point2f>> pixels(views.size());
  for (std::size_t i = 0; i < views.size(); ++i)
    points_of(data, data.frames[views[i]], &points[i], &pixels[i]);
  cv::Mat K = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat distortion_found = cv::Mat::zeros(5, 1, CV_64F);
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  // Few unknowns, so that rolling-shutter distortion is not taken for a lens.
  constexpr int kFlags = cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST |
                         cv::CALIB_FIX_PRINCIPAL_POINT | cv::CALIB_FIX_ASPECT_RATIO;
  try {
    cv::calibrateCamera(points, pixels, {data.width, data.height}, K, distortion_found, rotations,
                        translations, kFlags);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  LensVector lens = LensVector::Zero();
  lens[index(LensParameter::kFocalLengthU)] = K.at<double>(0, 0);
  lens[index(LensParameter::kFocalLengthV)] = K.at<double>(1, 1);
  lens[index(LensParameter::kCentreU)] = data.width / 2.0;
  lens[index(LensParameter::kCentreV)] = data.height / 2.0;
  lens[index(LensParameter::kK1)] = distortion_found.at<double>(0);
  for (int i = 0; i < kLensParameterCount; ++i) {
    if (knowledge.fixed[static_cast<std::size_t>(i)]) lens[i] = knowledge.mean[i];
  }
  if (!lens.allFinite() || lens[0] <= 0) return std::nullopt;
  return lens;
}

std::vector<FramePose> start_poses(const PatternData& data, const LensVector& lens) {
  std::vector<FramePose> poses;
  const double line_delay = lens[index(LensParameter::kLineDelay)];
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const PatternFrame& frame = data.frames[f];
    if (frame.observations.size() < kLeastPoints) continue;
    std::vector<cv::Point3f> points;
    std::vector<cv::Point2f> pixels;
    points_of(data, frame, &points, &pixels);
    cv::Vec3d rotation;
    cv::Vec3d translation;
    try {
      if (!cv::solvePnP(points, pixels, camera_matrix(lens), distortion(lens), rotation,
                        translation))
        continue;
    } catch (const cv::Exception&) {
      continue;
    }
    if (!(translation[2] > 0)) continue;
    FramePose pose;
    pose.frame = static_cast<int>(f);
    double rows = 0;
    for (const PatternObservation& observation : frame.observations) rows += observation.u.y();
    pose.time_s = frame.time_s + line_delay * rows / static_cast<double>(frame.observations.size());
    const Matrix3<double> R_camera_from_pattern =
        exp_so3(Vector3<double>(rotation[0], rotation[1], rotation[2]));
    pose.R_pattern_from_camera = R_camera_from_pattern.transpose();
    pose.centre = -pose.R_pattern_from_camera *
                  Vector3<double>(translation[0], translation[1], translation[2]);
    if (pose.centre.allFinite()) poses.push_back(pose);
  }
  return poses;
}

PoseCurve start_curve(const std::vector<FramePose>& poses, double spacing_s, double margin_s) {
  const double begin = poses.front().time_s - margin_s;
  const double end = poses.back().time_s + margin_s;
  const int count = std::max(1, static_cast<int>(std::ceil((end - begin) / spacing_s)));
  std::vector<double> knots;
  for (int i = 0; i <= count; ++i) knots.push_back(begin + (end - begin) * i / count);
  PoseCurve curve(knots);
  curve.R_0 = poses[poses.size() / 2].R_pattern_from_camera;

  // Chooses the rotation vectors that follow each other most closely (Oth 22).
  std::vector<PoseVector> values;
  for (const FramePose& pose : poses) {
    PoseVector x;
    Vector3<double> phi =
        log_so3(Matrix3<double>(curve.R_0.transpose() * pose.R_pattern_from_camera));
    const double angle = phi.norm();
    if (!values.empty() && angle > 1e-9) {
      const Vector3<double> before = values.back().tail<3>();
      const Vector3<double> axis = phi / angle;
      phi = axis * (angle + 2 * kPi * std::round((axis.dot(before) - angle) / (2 * kPi)));
    }
    x << pose.centre, phi;
    values.push_back(x);
  }
  const int size = curve.control_points();
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Matrix<double, Eigen::Dynamic, 6> g =
      Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(size, 6);
  const auto add = [&entries](int segment, const Vector4<double>& weights, double factor) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j)
        entries.emplace_back(segment + i, segment + j, factor * weights[i] * weights[j]);
    }
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SplineBasis basis = curve.basis(poses[i].time_s);
    add(basis.segment, basis.weight, 1);
    for (int k = 0; k < 4; ++k) g.row(basis.segment + k) += basis.weight[k] * values[i].transpose();
  }
  // Just holds the curve where the pattern was not seen.
  const double spacing = (end - begin) / count;
  for (int s = 0; s < curve.segments(); ++s) {
    for (const double x : {0.0, 1.0}) {
      add(s, curve.acceleration_weights(s, curve.knot(s) + x * spacing) * (spacing * spacing),
          1e-4);
    }
  }
  Eigen::SparseMatrix<double> H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(H);
  const Eigen::Matrix<double, Eigen::Dynamic, 6> points = ldlt.solve(g);
  for (int i = 0; i < size; ++i) curve.control_point(i) = points.row(i).transpose();
  return curve;
}

}  // namespace alidade::internal

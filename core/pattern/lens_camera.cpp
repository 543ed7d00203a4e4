#include "core/pattern/lens_camera.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "core/model/lens/zoom_law.h"
#include "core/model/rotation.h"

namespace alidade {
namespace {

constexpr int kColumns = 24;
constexpr int kRows = 16;
constexpr int kUnknowns = 6;  // ln f, ln alpha, k r^2 at the corner, rotation

struct GridPoint {
  double x = 0, y = 0;  // -1 to 1 over the image
  Vector2<double> u;    // px
  Vector3<double> d;    // camera frame, z = 1
};

// Sets the direction that the lens shows at u. False: there is none.
bool unproject_lens(const LensVector& lens, GridPoint* point) {
  constexpr double kTolerance_px = 1e-9;
  const double f_u = lens[index(LensParameter::kFocalLengthU)];
  const Vector2<double> x_d((point->u.x() - lens[index(LensParameter::kCentreU)]) / f_u,
                            (point->u.y() - lens[index(LensParameter::kCentreV)]) /
                                lens[index(LensParameter::kFocalLengthV)]);
  Vector2<double> x;
  if (!distortion_of(lens).undistort(x_d, kTolerance_px / f_u, &x)) return false;
  point->d = {x.x(), x.y(), 1};
  return true;
}

std::vector<GridPoint> grid_over(const LensVector& lens, int width, int height) {
  std::vector<GridPoint> grid;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      GridPoint point;
      point.x = (2 * column + 1.0) / kColumns - 1;
      point.y = (2 * row + 1.0) / kRows - 1;
      point.u = {0.5 * (1 + point.x) * width, 0.5 * (1 + point.y) * height};
      if (unproject_lens(lens, &point)) grid.push_back(point);
    }
  }
  return grid;
}

struct Fit {
  Camera<double> camera;
  double rms_px = 0;
};

// Gauss-Newton over the points of a part. Empty: too few points, or no convergence.
std::optional<Fit> fit(const std::vector<GridPoint>& part, const Camera<double>& start) {
  constexpr int kSteps = 20;
  constexpr std::size_t kFewest = 40;
  if (part.size() < kFewest) return std::nullopt;
  Fit result;
  result.camera = start;
  Matrix3<double> R = Matrix3<double>::Identity();
  const auto rows = static_cast<Eigen::Index>(2 * part.size());
  Eigen::MatrixXd J(rows, kUnknowns);
  Eigen::VectorXd error(rows);
  for (int step = 0; step < kSteps; ++step) {
    Camera<double>& camera = result.camera;
    const double k_unit = corner_unit(camera)[0];
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Vector3<double> d = R * part[i].d;
      Vector2<double> u;
      Matrix<double, 2, 3> J_u_d;
      Matrix<double, 2, kCameraParameterCount> J_u_camera;
      if (project(camera, d, &u, &J_u_d, &J_u_camera) != ProjectionStatus::kOk) return std::nullopt;
      const auto at = static_cast<Eigen::Index>(2 * i);
      error.segment<2>(at) = part[i].u - u;
      J.block<2, 3>(at, 0) << J_u_camera.col(camera_column::kFocalLength) * camera.focal_length,
          J_u_camera.col(camera_column::kAspect) * camera.aspect,
          J_u_camera.col(camera_column::kDistortion) * k_unit;
      J.block<2, 3>(at, 3) = -J_u_d * skew(d);
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(J);
    if (qr.rank() < kUnknowns) return std::nullopt;
    const Eigen::VectorXd change = qr.solve(error);
    if (!change.allFinite()) return std::nullopt;
    camera.focal_length *= std::exp(change[0]);
    camera.aspect *= std::exp(change[1]);
    camera.distortion.only_term() += k_unit * change[2];
    R = exp_so3(Vector3<double>(change.tail<3>())) * R;
    if (change.norm() > 1e-10) continue;
    result.rms_px = std::sqrt(error.squaredNorm() / static_cast<double>(rows));
    return result;
  }
  return std::nullopt;
}

// Parts of the image in which landmarks may lie.
using Part = std::function<bool(const GridPoint&)>;
std::array<Part, 6> parts() {
  constexpr double kInner = 0.64;  // of an ellipse of half the image's area: half axes squared
  const auto radius = [](const GridPoint& p) { return p.x * p.x + p.y * p.y; };
  return {[radius](const GridPoint& p) { return radius(p) < kInner; },
          [radius](const GridPoint& p) { return radius(p) >= kInner; },
          [](const GridPoint& p) { return p.x < 0; },
          [](const GridPoint& p) { return p.x > 0; },
          [](const GridPoint& p) { return p.y < 0; },
          [](const GridPoint& p) { return p.y > 0; }};
}

Vector3<double> parameters_of(const Camera<double>& camera) {
  return {camera.focal_length, camera.aspect, camera.distortion.only_term()};
}

// The fit over the whole image, and its grid.
std::optional<Fit> fit_lens(const LensVector& lens, int width, int height,
                            std::vector<GridPoint>* grid) {
  *grid = grid_over(lens, width, height);
  if (grid->size() < static_cast<std::size_t>(kColumns * kRows)) return std::nullopt;
  const double f = lens[index(LensParameter::kFocalLengthU)];
  return fit(*grid, {f,
                     lens[index(LensParameter::kFocalLengthV)] / f,
                     {lens[index(LensParameter::kK1)]},
                     width,
                     height});
}

// Step of a parameter for its numeric derivative: a small change in the image.
double step_of(const LensVector& lens, int parameter) {
  constexpr double kStep_px = 1e-3;
  const double f = lens[index(LensParameter::kFocalLengthU)];
  return parameter < index(LensParameter::kK1) ? kStep_px : kStep_px / f;
}

}  // namespace

std::optional<LensCamera> camera_of_lens(const LensVector& lens, const LensMatrix& covariance,
                                         int width, int height) {
  std::vector<GridPoint> grid;
  const std::optional<Fit> whole = fit_lens(lens, width, height, &grid);
  if (!whole) return std::nullopt;
  LensCamera result;
  result.camera = whole->camera;
  result.line_delay = lens[index(LensParameter::kLineDelay)];
  result.misfit_px = whole->rms_px;
  Matrix<double, 4, kLensParameterCount> J = Matrix<double, 4, kLensParameterCount>::Zero();
  for (int i = 0; i < index(LensParameter::kLineDelay); ++i) {
    std::vector<GridPoint> of_changed;
    LensVector changed = lens;
    const double step = step_of(lens, i);
    changed[i] += step;
    const std::optional<Fit> after = fit_lens(changed, width, height, &of_changed);
    if (!after) return std::nullopt;
    J.block<3, 1>(0, i) = (parameters_of(after->camera) - parameters_of(whole->camera)) / step;
  }
  J(3, index(LensParameter::kLineDelay)) = 1;
  result.covariance = J * covariance * J.transpose();
  Vector3<double> largest = Vector3<double>::Zero();
  for (const Part& is_in : parts()) {
    std::vector<GridPoint> part;
    std::copy_if(grid.begin(), grid.end(), std::back_inserter(part), is_in);
    const std::optional<Fit> of_part = fit(part, whole->camera);
    if (!of_part) return std::nullopt;
    largest = largest.cwiseMax(
        (parameters_of(of_part->camera) - parameters_of(whole->camera)).cwiseAbs());
  }
  for (int i = 0; i < 3; ++i) result.covariance(i, i) += largest[i] * largest[i];
  return result;
}

}  // namespace alidade

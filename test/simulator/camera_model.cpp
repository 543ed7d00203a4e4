#include "test/simulator/camera_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade::simulator {
namespace {

// Linear interpolation in a table this long is good to 1e-4 px or better: see camera_model_test.
constexpr std::size_t kTableSize = 1 << 16;
// Boil and the corners' own pixels look a little past the image's corner.
constexpr double kTableMargin = 1.2;

// Turns the unit vector `axis` by a small angle towards the two tangent directions.
Eigen::Vector3d tilted(const Eigen::Vector3d& axis, const Eigen::Vector3d& tangent_0,
                       const Eigen::Vector3d& tangent_1, const Eigen::Vector2d& offset) {
  const double angle = offset.norm();
  if (angle == 0) return axis;
  const Eigen::Vector3d towards = (tangent_0 * offset.x() + tangent_1 * offset.y()) / angle;
  return axis * std::cos(angle) + towards * std::sin(angle);
}

}  // namespace

CameraModel::CameraModel(const CameraConfig& camera, const ImageConfig& image, const Path& path,
                         std::optional<Zoom> zoom)
    : camera_(camera),
      image_(image),
      path_(&path),
      zoom_(std::move(zoom)),
      lens_(zoom_ ? zoom_->lens(0)
                  : Lens{camera.focal_length, camera.aspect, camera.radial_distortion,
                         camera.centre + Eigen::Vector2d(image.width, image.height) / 2,
                         camera.radial_distortion_2, camera.tangential}),
      tangential_(!lens_.tangential.isZero(0)),
      per_focal_(
          Eigen::Vector2d(lens_.focal_length, lens_.focal_length * lens_.aspect).cwiseInverse()),
      pan_axis_(tilted(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                       camera.pan_axis_offset)),
      tilt_axis_(tilted(Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX(),
                        Eigen::Vector3d::UnitZ(), camera.tilt_axis_offset)) {
  const double k = lens_.radial_distortion;
  const double k2 = lens_.radial_distortion_2;
  // The corner that is farthest from the optical centre.
  const Eigen::Vector2d size(image.width, image.height);
  const Eigen::Vector2d farthest = lens_.centre.cwiseMax(size - lens_.centre);
  const double corner_squared = (farthest.cwiseQuotient(Eigen::Vector2d(
                                     lens_.focal_length, lens_.focal_length * lens_.aspect)))
                                    .squaredNorm();
  // At the largest slope the distorted radius is 2/3 of it where there is no k2.
  const double fold = lens_.largest_slope_squared();
  const double shrunk = k2 == 0 ? 4.0 / 9 : lens_.radial(fold) * lens_.radial(fold);
  const double largest_squared = std::isfinite(fold)
                                     ? std::min(corner_squared * kTableMargin, fold * shrunk)
                                     : corner_squared * kTableMargin;
  samples_per_square_ = static_cast<double>(kTableSize - 1) / largest_squared;
  shrink_.reserve(kTableSize);
  double slope = 0;
  for (std::size_t i = 0; i < kTableSize; ++i) {
    const double radius = std::sqrt(static_cast<double>(i) / samples_per_square_);
    // Newton from the previous entry; near the fold (k < 0) it converges slowly, hence the count.
    for (int step = 0; step < 60; ++step) {
      const double fourth = k2 * slope * slope * slope * slope;
      const double derivative = 1 + 3 * k * slope * slope + 5 * fourth;
      const double excess = slope + k * slope * slope * slope + fourth * slope - radius;
      if (derivative < 1e-9 || std::abs(excess) < 1e-16) break;
      slope -= excess / derivative;
    }
    shrink_.push_back(radius > 0 ? slope / radius : 1);
  }
}

Lens CameraModel::lens_at(double time_s) const {
  Lens lens = zoom_ ? zoom_->lens(time_s) : lens_;
  const Breathing& breathing = camera_.breathing;
  if (breathing.part == 0) return lens;
  const double periods = time_s / breathing.period;
  lens.focal_length *= 1 + breathing.part * (breathing.type == Breathing::Type::kLinear
                                                 ? std::clamp(periods, 0.0, 1.0)
                                                 : std::sin(kTwoPi * periods) / 2);
  return lens;
}

Eigen::Matrix3d CameraModel::base_from_camera(const Angles& angles) const {
  Eigen::Matrix3d base_from_rdf;  // right, down and forward, each in forward-right-down
  base_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::AngleAxisd(angles.pan, pan_axis_).toRotationMatrix() *
         Eigen::AngleAxisd(angles.tilt, tilt_axis_).toRotationMatrix() * base_from_rdf;
}

Eigen::Matrix3d CameraModel::world_from_camera_at(double time_s) const {
  const Eigen::Matrix3d turned = base_from_camera_at(time_s);
  if (!sways()) return turned;
  Eigen::Vector3d sway = Eigen::Vector3d::Zero();
  for (const Swing& swing : camera_.sway) {
    sway[static_cast<int>(swing.axis)] +=
        swing.amplitude * std::sin(kTwoPi * swing.frequency * time_s + swing.phase);
  }
  const double angle = sway.norm();
  if (angle == 0) return turned;
  return Eigen::AngleAxisd(angle, sway / angle).toRotationMatrix() * turned;
}

std::optional<Eigen::Vector2d> CameraModel::project_rolling(const Eigen::Vector3d& d_world,
                                                            double t0_s,
                                                            double inverse_distance) const {
  const Eigen::Vector3d parallax = inverse_distance * camera_.pupil;
  const auto seen_from_row = [&](double row) {
    const double time = t0_s + row * camera_.line_delay;
    return lens_at(time).project(world_from_camera_at(time).transpose() * d_world - parallax);
  };
  // The row that is exposed while the direction lies on it: the root of v(row) - row, by false position in which the end that
  // stays counts half (Illinois).
  double low = 0;
  double high = image_.height;
  const auto first = seen_from_row(low);
  const auto last = seen_from_row(high);
  if (!first || !last || first->y() < low || last->y() > high) return std::nullopt;
  double at_low = first->y() - low;
  double at_high = last->y() - high;
  constexpr double kRows = 1e-10;
  double row = low;
  int stayed = 0;  // the end that stays: -1 the low one, 1 the high one
  for (int step = 0; step < 60 && high - low > kRows; ++step) {
    row = at_low > at_high ? (low * at_high - high * at_low) / (at_high - at_low) : low;
    const auto seen = seen_from_row(row);
    if (!seen) return std::nullopt;
    const double off = seen->y() - row;
    if (std::abs(off) < kRows) break;
    if (off > 0) {
      low = row;
      at_low = off;
      if (stayed == 1) at_high /= 2;
      stayed = 1;
    } else {
      high = row;
      at_high = off;
      if (stayed == -1) at_low /= 2;
      stayed = -1;
    }
  }
  auto seen = seen_from_row(row);
  if (!seen || seen->x() < 0 || seen->x() > image_.width) return std::nullopt;
  return seen;
}

}  // namespace alidade::simulator

#include "test/simulator/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>

#include "test/simulator/noise_field.h"
#include "test/simulator/random.h"

namespace alidade::simulator {
namespace {

// Texels a pixel at the optical axis: dense enough that Catmull-Rom passes what a pixel passes.
constexpr double kTexelsPerPixel = 1.4;
constexpr double kLargestTexture = 1e8;  // texels of 4 bytes; the pyramid adds a third
constexpr int kProceduralWidth = 1024;   // px of the generated photo
// The mip level is chosen once for so many pixels of a row.
constexpr std::size_t kBlock = 16;
constexpr std::size_t kMostPatches = 32;

using Projection = PatchConfig::Projection;

// Rows: right, down and outward at the patch's centre, in base.
Eigen::Matrix3d patch_from_base(double azimuth, double elevation) {
  Eigen::Matrix3d rows;
  rows.row(0) << -std::sin(azimuth), std::cos(azimuth), 0;
  rows.row(2) = direction(azimuth, elevation).transpose();
  rows.row(1) = rows.row(2).cross(rows.row(0));
  return rows;
}

// Patch coordinates of a direction in the patch's frame; NaN on the far side of a tangent plane.
inline Eigen::Vector2d patch_coordinates(Projection projection, double right, double down,
                                         double outward) {
  if (projection == Projection::kEquirectangular) {
    return {std::atan2(right, outward), std::atan2(down, std::hypot(right, outward))};
  }
  const double scale = outward > 0 ? 1 / outward : std::numeric_limits<double>::quiet_NaN();
  return {right * scale, down * scale};
}

double half_extent(Projection projection, double angle) {
  return projection == Projection::kTangent ? std::tan(angle / 2) : angle / 2;
}

// The part of a patch, in patch coordinates, that holds everything seen, with a margin of a tenth.
std::optional<Eigen::AlignedBox2d> seen_part(const PatchConfig& config,
                                             const std::vector<Eigen::Vector3d>& seen,
                                             const Eigen::Vector2d& half_size) {
  const Eigen::Matrix3d rows = patch_from_base(config.azimuth, config.elevation);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector3d& d_base : seen) {
    const Eigen::Vector3d d_patch = rows * d_base;
    // Just above the patch plane's horizon the tangents run away, far beyond any patch.
    if (config.projection == Projection::kTangent && d_patch.z() < 0.02) continue;
    box.extend(patch_coordinates(config.projection, d_patch.x(), d_patch.y(), d_patch.z()));
  }
  if (box.isEmpty()) return std::nullopt;
  const Eigen::Vector2d margin = 0.1 * box.sizes();
  box.min() -= margin;
  box.max() += margin;
  box = box.intersection(Eigen::AlignedBox2d(-half_size, half_size));
  if (box.isEmpty() || box.sizes().minCoeff() <= 0) return std::nullopt;
  return box;
}

// From pixel to pixel of a block, in the coordinates given.
double pixel_spacing(const std::array<double, kBlock>& x, const std::array<double, kBlock>& y,
                     const std::array<float, kBlock>& cover, std::size_t size) {
  for (std::size_t i = 0; i + 1 < size; ++i) {
    if (cover[i] > 0 && cover[i + 1] > 0) return std::hypot(x[i + 1] - x[i], y[i + 1] - y[i]);
  }
  return 0;
}

// The mip level for pixels so many texels apart: at most one texel of the level a pixel keeps the picture smooth.
double level_of(double spacing) { return std::log2(0.7 * std::max(1e-3, spacing)); }

// A rectangle with a coarse pattern, so that it looks like something and not like a flat area.
cv::Mat object_picture(double brightness) {
  cv::Mat picture(32, 64, CV_32F, cv::Scalar(brightness));
  for (int y = 4; y < 28; ++y) {
    for (int x = 4; x < 60; ++x) {
      if ((x / 14 + y / 12) % 2 == 0) picture.at<float>(y, x) += brightness > 0.5 ? -0.3F : 0.3F;
    }
  }
  return picture;
}

}  // namespace

Eigen::Vector3d direction(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          -std::sin(elevation)};
}

Scene::Scene(const SceneConfig& config, const std::vector<Sight>& sights, bool zooms,
             std::uint64_t seed)
    : background_(static_cast<float>(config.background)),
      longest_focal_length_(sights.front().focal_length),
      flutter_seed_(mix(seed, static_cast<std::uint64_t>(Stream::kFlutter))),
      zooms_(zooms) {
  if (config.clouds) {
    clouds_.emplace(*config.clouds, longest_focal_length_,
                    mix(seed, static_cast<std::uint64_t>(Stream::kClouds)));
  }
  if (config.water) {
    water_.emplace(*config.water, longest_focal_length_,
                   mix(seed, static_cast<std::uint64_t>(Stream::kWater)));
  }
  for (const PatchConfig& moving : config.moving) {
    add_object(moving, object_picture(moving.brightness));
  }
  for (const PatchConfig& flat : config.flat) {
    add_object(flat, cv::Mat(8, 8, CV_32F, cv::Scalar(flat.brightness)));
  }
  std::uint64_t texture_seed = mix(seed, static_cast<std::uint64_t>(Stream::kTexture));
  for (const PatchConfig& photo : config.photos) {
    cv::Mat bytes;
    // imread() would write a warning of its own about a file that is not there.
    if (std::filesystem::exists(photo.file)) {
      bytes = cv::imread(photo.file.string(), cv::IMREAD_GRAYSCALE);
    }
    if (bytes.empty()) throw ConfigError(photo.file.string() + ": not a picture that can be read");
    cv::Mat picture;
    bytes.convertTo(picture, CV_32F, 1 / 255.0);
    add_photo(photo, picture, sights, config.detail, ++texture_seed);
  }
  for (const PatchConfig& procedural : config.procedural) {
    const double shape = half_extent(procedural.projection, procedural.height) /
                         half_extent(procedural.projection, procedural.width);
    const int height = std::max(1, static_cast<int>(std::lround(kProceduralWidth * shape)));
    ++texture_seed;
    add_photo(procedural, make_procedural(kProceduralWidth, height, mix(texture_seed)), sights,
              config.detail, texture_seed);
  }
  std::uint64_t depth_seed = mix(seed, static_cast<std::uint64_t>(Stream::kDepth));
  for (Patch& patch : patches_) {
    ++depth_seed;
    if (patch.config.distance) patch.depth.emplace(*patch.config.distance, mix(depth_seed));
  }
  const auto distance = [](const Patch& patch) {
    return patch.depth ? patch.depth->nearest() : std::numeric_limits<double>::infinity();
  };
  std::stable_sort(patches_.begin(), patches_.end(),
                   [&](const Patch& a, const Patch& b) { return distance(a) < distance(b); });
  if (patches_.size() > kMostPatches) {
    throw ConfigError("scene: at most " + std::to_string(kMostPatches) + " patches can be seen");
  }
}

void Scene::add_object(const PatchConfig& config, const cv::Mat& picture) {
  const Eigen::Vector2d half_size(half_extent(config.projection, config.width),
                                  half_extent(config.projection, config.height));
  const Eigen::Vector2d texels(picture.cols, picture.rows);
  Patch patch{config, half_size, {}, {}};
  patch.layers.push_back({Texture(picture), -half_size, texels.cwiseQuotient(2 * half_size),
                          Eigen::AlignedBox2d(-half_size, half_size)});
  patches_.push_back(std::move(patch));
}

void Scene::add_photo(const PatchConfig& config, const cv::Mat& photo,
                      const std::vector<Sight>& sights, double detail, std::uint64_t seed) {
  Eigen::Vector2d half_size;
  half_size.x() = half_extent(config.projection, config.width);
  half_size.y() = half_size.x() * photo.rows / photo.cols;
  const std::string name = config.file.empty() ? "procedural patch" : config.file.string();
  if (config.projection == Projection::kEquirectangular && half_size.y() > 1.5708) {
    throw ConfigError(name + ": is more than 180 degrees high; make it narrower");
  }
  const double photo_density = photo.cols / (2 * half_size.x());
  Patch patch{config, half_size, {}, {}};
  for (const Sight& sight : sights) {
    const auto part = seen_part(config, sight.seen, half_size);
    if (!part) continue;
    const Eigen::Vector2d low = (part->min() + half_size) * photo_density;
    const Eigen::Vector2d high = (part->max() + half_size) * photo_density;
    const cv::Point first(static_cast<int>(std::floor(low.x())) - 4,
                          static_cast<int>(std::floor(low.y())) - 4);
    const cv::Point last(static_cast<int>(std::ceil(high.x())) + 4,
                         static_cast<int>(std::ceil(high.y())) + 4);
    const cv::Rect window = cv::Rect(first, last) & cv::Rect(0, 0, photo.cols, photo.rows);
    const double scale = sight.focal_length * kTexelsPerPixel / photo_density;
    if (window.width * scale * window.height * scale > kLargestTexture) {
      throw ConfigError(name +
                        ": the area swept at this focal length is too large to be prepared; " +
                        "take a smaller path amplitude, width_deg or focal_length_px");
    }
    cv::Mat picture = make_detailed(photo, window, scale, detail, zooms_, seed);
    const Eigen::Vector2d texels(picture.cols, picture.rows);
    const Eigen::Vector2d extent = Eigen::Vector2d(window.width, window.height) / photo_density;
    const Eigen::Vector2d corner = Eigen::Vector2d(window.x, window.y) / photo_density - half_size;
    patch.layers.push_back({Texture(picture), corner, texels.cwiseQuotient(extent), *part});
  }
  if (!patch.layers.empty()) patches_.push_back(std::move(patch));
}

std::size_t Scene::layer_for(const Patch& patch, double spacing, const Eigen::AlignedBox2d& box) {
  std::size_t i = patch.layers.size() - 1;
  while (i > 0 && level_of(spacing * patch.layers[i].density.x()) < 0 &&
         patch.layers[i - 1].part.contains(box)) {
    --i;
  }
  return i;
}

float Scene::zoomed_sample(const Patch& patch, std::size_t layer, double level,
                           const Eigen::Vector2d& point) {
  const Layer& fine = patch.layers[layer];
  const Eigen::Vector2d texel = (point - fine.corner).cwiseProduct(fine.density);
  if (layer + 1 == patch.layers.size()) {
    return fine.texture.sample_between(texel.x(), texel.y(), level);
  }
  const float value = fine.texture.sample(texel.x(), texel.y(), 0);
  if (level <= 0.5) return value;
  const Layer& coarse = patch.layers[layer + 1];
  const Eigen::Vector2d other = (point - coarse.corner).cwiseProduct(coarse.density);
  const auto part = static_cast<float>(std::clamp(2 * level - 1, 0.0, 1.0));
  return value + part * (coarse.texture.sample(other.x(), other.y(), 0) - value);
}

void Scene::add_clouds_and_water(const Eigen::Matrix3d& base_from_camera, double time_s,
                                 const double* x, const double* y, std::size_t size, float* shine,
                                 float* open) const {
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Vector3d ray = base_from_camera * Eigen::Vector3d(x[i], y[i], 1);
    if (ray.hasNaN()) continue;
    const double azimuth = std::atan2(ray.y(), ray.x());
    const double elevation = -std::atan2(ray.z(), std::hypot(ray.x(), ray.y()));
    const auto take = [&](const Cover& it) {
      shine[i] += open[i] * it.part * it.brightness;
      open[i] *= 1 - it.part;
    };
    if (clouds_) take(clouds_->at(azimuth, elevation, time_s));
    if (water_ && open[i] > 0) take(water_->at(azimuth, elevation, time_s));
  }
}

void Scene::flutter(const FlutterConfig& config, double time_s, std::uint64_t seed, double* right,
                    double* down) const {
  const double per_size = longest_focal_length_ / config.size_px;
  const double scale = config.rms_px / longest_focal_length_ / kSpaceRms;
  const double x = *right * per_size;
  const double y = *down * per_size;
  const double time = time_s * config.rate_hz;
  *right += scale * smooth_noise(x, y, time, seed);
  *down += scale * smooth_noise(x, y, time, seed + 1);
}

void Scene::shade(const Eigen::Matrix3d& base_from_camera, const Eigen::Vector3d& pupil,
                  double time_s, double focal_length, const double* x, const double* y,
                  std::size_t count, float weight, float* sum) const {
  std::array<Eigen::Matrix3d, kMostPatches> patch_from_camera;
  for (std::size_t n = 0; n < patches_.size(); ++n) {
    const PatchConfig& config = patches_[n].config;
    patch_from_camera[n] = patch_from_base(config.azimuth + config.azimuth_rate * time_s,
                                           config.elevation + config.elevation_rate * time_s) *
                           base_from_camera;
  }

  std::array<float, kBlock> shine{};  // light of the block, front patches first
  std::array<float, kBlock> open{};   // share of each pixel that no patch has covered yet
  for (std::size_t start = 0; start < count; start += kBlock) {
    const std::size_t size = std::min(kBlock, count - start);
    shine.fill(0);
    open.fill(1);
    if (clouds_ || water_) {
      add_clouds_and_water(base_from_camera, time_s, x + start, y + start, size, shine.data(),
                           open.data());
    }
    for (std::size_t n = 0; n < patches_.size(); ++n) {
      const Patch& patch = patches_[n];
      const Eigen::Matrix3d& turn = patch_from_camera[n];
      std::array<double, kBlock> right{};  // patch coordinates
      std::array<double, kBlock> down{};
      std::array<float, kBlock> cover{};
      float most = 0;
      const bool parallax = patch.depth && !pupil.isZero(0);
      const Eigen::Vector3d from = turn * pupil;
      const auto coordinates = [&](const Eigen::Vector3d& v) {
        return patch_coordinates(patch.config.projection, v.x(), v.y(), v.z());
      };
      for (std::size_t i = 0; i < size; ++i) {
        const double ray_x = x[start + i];
        const double ray_y = y[start + i];
        const Eigen::Vector3d ray(turn(0, 0) * ray_x + turn(0, 1) * ray_y + turn(0, 2),
                                  turn(1, 0) * ray_x + turn(1, 1) * ray_y + turn(1, 2),
                                  turn(2, 0) * ray_x + turn(2, 1) * ray_y + turn(2, 2));
        const Eigen::Vector2d point =
            parallax ? patch.depth->seen(ray, from, coordinates) : coordinates(ray);
        right[i] = point.x();
        down[i] = point.y();
        const double inside =
            0.5 + focal_length * std::min(patch.half_size.x() - std::abs(point.x()),
                                          patch.half_size.y() - std::abs(point.y()));
        // A NaN, of the ray or of the far side, is not inside.
        cover[i] = inside > 0 ? static_cast<float>(std::min(inside, 1.0)) : 0.0F;
        most = std::max(most, cover[i]);
      }
      if (most == 0) continue;
      if (patch.config.flutter) {
        for (std::size_t i = 0; i < size; ++i) {
          if (cover[i] > 0)
            flutter(*patch.config.flutter, time_s, mix(flutter_seed_, n), &right[i], &down[i]);
        }
      }
      std::size_t number = 0;
      if (patch.layers.size() > 1) {
        Eigen::AlignedBox2d box;
        for (std::size_t i = 0; i < size; ++i) {
          if (cover[i] > 0) box.extend(Eigen::Vector2d(right[i], down[i]));
        }
        // The soft border is outside of the patch.
        box = box.intersection(Eigen::AlignedBox2d(-patch.half_size, patch.half_size));
        number = layer_for(patch, pixel_spacing(right, down, cover, size), box);
      }
      const Layer& layer = patch.layers[number];
      std::array<double, kBlock> texel_x{};
      std::array<double, kBlock> texel_y{};
      for (std::size_t i = 0; i < size; ++i) {
        texel_x[i] = (right[i] - layer.corner.x()) * layer.density.x();
        texel_y[i] = (down[i] - layer.corner.y()) * layer.density.y();
      }
      const double exact = level_of(pixel_spacing(texel_x, texel_y, cover, size));
      const int level =
          std::clamp(static_cast<int>(std::lround(exact)), 0, layer.texture.highest_level());
      for (std::size_t i = 0; i < size; ++i) {
        if (cover[i] * open[i] <= 0) continue;
        shine[i] += open[i] * cover[i] *
                    (zooms_ ? zoomed_sample(patch, number, exact, {right[i], down[i]})
                            : layer.texture.sample(texel_x[i], texel_y[i], level));
        open[i] *= 1 - cover[i];
      }
    }
    for (std::size_t i = 0; i < size; ++i) {
      if (x[start + i] == x[start + i]) {
        sum[start + i] += weight * (shine[i] + open[i] * background_);
      }
    }
  }
}

}  // namespace alidade::simulator

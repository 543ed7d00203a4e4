#pragma once
// The far scene around the virtual camera: patches on the sphere, the first in front.
//
// Order: clouds, water, moving objects, flat areas, photos, procedural patches, background. A patch
// with a distance is seen from the camera's pupil (depth_map.h), and a nearer patch is in front of
// a farther one, whatever their order. A patch is centred on a direction (azimuth positive right,
// elevation positive up; in base, FRD: (cos e cos a, cos e sin a, -sin e)), upright there, and
// mapped rectilinearly (tangent plane) or by longitude and latitude about its own centre. Borders
// are soft over one pixel. Brightness: 0 black, 1 white, linear. Texture densities:
// docs/simulator.md. shade() is thread-safe and does not allocate.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "test/simulator/clouds.h"
#include "test/simulator/config.h"
#include "test/simulator/depth_map.h"
#include "test/simulator/texture.h"

namespace alidade::simulator {

// Unit vector in the base frame.
[[nodiscard]] Eigen::Vector3d direction(double azimuth, double elevation);

// What will be seen with about this focal length or, under a zoom, a longer one.
struct Sight {
  double focal_length = 0;  // px
  // In base; their surroundings will be seen. Enough of them to bound that area.
  std::vector<Eigen::Vector3d> seen;
};

class Scene {
 public:
  // sights: one without zoom; with a zoom one for each doubling of the focal length, the longest
  // first, and the last one with all that is seen. Throws ConfigError: photo unreadable, or scene
  // too large.
  Scene(const SceneConfig& config, const std::vector<Sight>& sights, bool zooms,
        std::uint64_t seed);

  // Adds to sum[i] the brightness along each ray (x[i], y[i], 1) of the camera frame, times weight.
  // Neighbours in the arrays are neighbours in the image, a pixel apart. A NaN ray adds nothing.
  // focal_length: px, of that moment. pupil: m, in the camera frame.
  void shade(const Eigen::Matrix3d& base_from_camera, const Eigen::Vector3d& pupil, double time_s,
             double focal_length, const double* x, const double* y, std::size_t count, float weight,
             float* sum) const;

 private:
  struct Layer {
    Texture texture;
    // Texel = density * (patch coordinate - corner); patch coordinates are tangents or angles from
    // the centre, to the right and down.
    Eigen::Vector2d corner, density;
    Eigen::AlignedBox2d part;  // of the patch, in patch coordinates, that it holds
  };
  struct Patch {
    PatchConfig config;
    Eigen::Vector2d half_size;      // of the whole patch, in patch coordinates
    std::vector<Layer> layers;      // the densest first
    std::optional<DepthMap> depth;  // nothing: infinitely far
  };

  void add_photo(const PatchConfig& config, const cv::Mat& photo, const std::vector<Sight>& sights,
                 double detail, std::uint64_t seed);
  void add_object(const PatchConfig& config, const cv::Mat& picture);
  // The coarsest layer that is dense enough for pixels `spacing` apart and holds the box, all in
  // patch coordinates; else the nearest.
  [[nodiscard]] static std::size_t layer_for(const Patch& patch, double spacing,
                                             const Eigen::AlignedBox2d& box);
  // From a layer and the next coarser one, so that nothing jumps between them. level: of the
  // former, at which pixels are apart.
  [[nodiscard]] static float zoomed_sample(const Patch& patch, std::size_t layer, double level,
                                           const Eigen::Vector2d& point);

  // Clouds and water take what they cover of the block's rays.
  void add_clouds_and_water(const Eigen::Matrix3d& base_from_camera, double time_s, const double* x,
                            const double* y, std::size_t size, float* shine, float* open) const;

  // Shifts a place of a patch, in patch coordinates.
  void flutter(const FlutterConfig& config, double time_s, std::uint64_t seed, double* right,
               double* down) const;

  float background_;
  std::optional<Clouds> clouds_;
  std::optional<Water> water_;
  double longest_focal_length_;  // px
  std::uint64_t flutter_seed_;
  bool zooms_;
  std::vector<Patch> patches_;
};

}  // namespace alidade::simulator

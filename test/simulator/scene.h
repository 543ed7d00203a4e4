#pragma once
// The far scene around the virtual camera: patches on the sphere, the first in front.
//
// Order: moving objects, flat areas, photos, procedural patches, background. A patch is centred on a
// direction (azimuth positive right, elevation positive up; in base, FRD:
// (cos e cos a, cos e sin a, -sin e)), upright there, and mapped either rectilinearly (tangent plane)
// or by longitude and latitude about its own centre. Borders are soft over one pixel.
// Each patch is prepared once at the density the camera needs (about 1.4 texels a pixel at the optical
// axis), over the part that will be seen. Brightness: 0 black, 1 white, linear.
// shade() is thread-safe and does not allocate.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "test/simulator/config.h"
#include "test/simulator/texture.h"

namespace alidade::simulator {

// Unit vector in the base frame.
[[nodiscard]] Eigen::Vector3d direction(double azimuth, double elevation);

class Scene {
 public:
  // focal_length: of the camera, px. seen: directions in base whose surroundings will be seen,
  // enough of them to bound that area. Throws ConfigError: photo unreadable, or scene too large.
  Scene(const SceneConfig& config, double focal_length, const std::vector<Eigen::Vector3d>& seen,
        std::uint64_t seed);

  // Adds to sum[i] the brightness along each ray (x[i], y[i], 1) of the camera frame, times weight.
  // Neighbours in the arrays are neighbours in the image, a pixel apart. A NaN ray adds nothing.
  void shade(const Eigen::Matrix3d& base_from_camera, double time_s, const double* x,
             const double* y, std::size_t count, float weight, float* sum) const;

 private:
  struct Patch {
    PatchConfig config;
    Texture texture;
    // Texel = density * (patch coordinate - corner); patch coordinates are tangents or angles from
    // the centre, to the right and down.
    Eigen::Vector2d corner, density;
    Eigen::Vector2d half_size;  // of the whole patch, in patch coordinates
  };

  void add_photo(const PatchConfig& config, const cv::Mat& photo,
                 const std::vector<Eigen::Vector3d>& seen, double density, double detail,
                 std::uint64_t seed);
  void add_object(const PatchConfig& config, const cv::Mat& picture);

  float background_;
  double pixels_per_unit_;  // at the optical axis
  std::vector<Patch> patches_;
};

}  // namespace alidade::simulator

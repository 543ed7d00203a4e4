#pragma once
// Stills of the virtual camera (test/simulator) at any orientation and zoom, with their truth, for judging a map.
//   camera   1280x720, 20x zoom from 1250 px on, distortion, optical centre off and wandering, f off by the repeatability after each
//            movement; at rest when a picture is taken
//   scene    photos in front of ever wider ones, generated contrast at every scale
// Noise of 2 grey levels. A picture is rendered once and kept in the folder given. No code of core/.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "test/simulator/renderer.h"

namespace alidade::test {

struct StillView {
  double pan = 0;           // rad
  double tilt = 0;          // rad
  double focal_length = 0;  // px, by the curve of the lens
};

class RenderedStills {
 public:
  // The seed draws how the lens comes to rest and what there is to see; what lies at long focal lengths should come in a row: the
  // scene is made as fine as it is seen.
  RenderedStills(std::vector<StillView> views, std::uint64_t seed,
                 const std::filesystem::path& cache);
  RenderedStills(const RenderedStills&) = delete;
  RenderedStills& operator=(const RenderedStills&) = delete;

  [[nodiscard]] int size() const { return static_cast<int>(views_.size()); }
  [[nodiscard]] cv::Mat image(int i) const;
  [[nodiscard]] const StillView& view(int i) const { return views_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Eigen::Matrix3d base_from_camera(int i) const;
  [[nodiscard]] simulator::Lens lens(int i) const;
  // In whole steps.
  [[nodiscard]] double zoom_reading(int i) const;
  [[nodiscard]] const simulator::Config& config() const { return config_; }

 private:
  std::vector<StillView> views_;
  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  std::optional<simulator::CameraModel> camera_;
  mutable std::unique_ptr<simulator::Renderer> renderer_;  // made when the first picture has to be
  std::filesystem::path cache_;
};

// 3 columns - 2 views, in three rows, at each of five focal lengths, each level about the middle of the wider one;
// with more columns they lie closer.
[[nodiscard]] std::vector<StillView> map_views(int columns);
// Views inside those, at any focal length between the levels' least and most, the longest first.
[[nodiscard]] std::vector<StillView> random_views(int count, std::uint64_t seed);

inline constexpr double kWidestFocalLength_px = 1250;
inline constexpr int kStillLevels = 5;

}  // namespace alidade::test

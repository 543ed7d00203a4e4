#pragma once
// tracks.csv: where the landmarks of a made-up grid appear in each frame, with noise.
//
// Landmarks stand on a grid of azimuth and elevation over the whole sphere, `landmark_spacing`
// fields of view apart. Under a zoom there are nested grids, each twice as dense as the one before,
// the first for the shortest focal length of the path. A frame shows the grid whose spacing is
// nearest to the one asked for, without the points of the grid kLandmarkOctaves before it: a small
// detail at one end fills the image at the other. A landmark keeps its direction and number at
// every zoom.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "test/simulator/camera_model.h"
#include "test/simulator/timeline.h"

namespace alidade::simulator {

// Over so many doublings of the focal length a landmark is seen.
inline constexpr int kLandmarkOctaves = 3;

struct TrackedPoint {
  std::int64_t frame = 0;
  int landmark = 0;
  double u = 0, v = 0;          // px, with noise of config.recording.pixel_sigma
  double inverse_distance = 0;  // 1/m, of the landmark
};

// By frame.
[[nodiscard]] std::vector<TrackedPoint> make_tracks(const Config& config,
                                                    const std::vector<FrameEvent>& frames,
                                                    const CameraModel& camera);

// With landmark distances also truth_landmarks.csv beside it: landmark,inverse_distance_per_m.
// Throws std::runtime_error naming the file if it cannot be written.
void write_tracks(const Config& config, const std::vector<FrameEvent>& frames,
                  const CameraModel& camera, const std::filesystem::path& file);

}  // namespace alidade::simulator

#include "test/simulator/track_writer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "test/simulator/noise_field.h"
#include "test/simulator/random.h"
#include "test/simulator/scene.h"
#include "test/simulator/truth.h"

namespace alidade::simulator {
namespace {

constexpr double kTrackPi = 3.14159265358979323846;
// Doublings that the numbers of a grid's points have room for.
constexpr int kMostOctaves = 12;

// How many of the grids that are nested in it a point of grid `octave` is in, itself not counted.
int coarser_grids(int row, int column, int octave) {
  int count = 0;
  while (count < octave && (row >> count) % 2 == 0 && (column >> count) % 2 == 0) ++count;
  return count;
}

// Of the landmark at a place of the grid, 1/m.
double inverse_distance(const Config& config, const std::pair<int, int>& place) {
  const auto& distance = config.recording.landmark_distance;
  if (!distance) return 0;
  const std::uint64_t seed = mix(config.seed, static_cast<std::uint64_t>(Stream::kDepth));
  const double part = (1 + lattice_value(place.first, place.second, 0, seed)) / 2;
  return std::pow(distance->nearest / distance->farthest, part) / distance->nearest;
}

}  // namespace

std::vector<TrackedPoint> make_tracks(const Config& config, const std::vector<FrameEvent>& frames,
                                      const CameraModel& camera) {
  std::vector<TrackedPoint> tracks;
  const Zoom* zoom = camera.zoom();
  const double shortest = zoom != nullptr ? zoom->focal_lengths().wide : config.camera.focal_length;
  const double wanted =
      config.recording.landmark_spacing *
      (zoom != nullptr ? field_of_view(config.image, shortest) : horizontal_field_of_view(config));
  const int coarsest_around = std::max(4, static_cast<int>(std::lround(2 * kTrackPi / wanted)));
  std::map<std::pair<int, int>, int> numbers;
  std::mt19937_64 generator = make_generator(config.seed, Stream::kTracks);
  std::normal_distribution<double> noise(0, config.recording.pixel_sigma);
  for (const FrameEvent& event : frames) {
    const double focal_length = camera.lens_at(event.capture_s).focal_length;
    const int octave = std::clamp(static_cast<int>(std::lround(std::log2(focal_length / shortest))),
                                  0, kMostOctaves);
    const int around = coarsest_around << octave;
    const double spacing = 2 * kTrackPi / around;
    const double reach =
        0.55 * std::atan2(std::hypot(config.image.width, config.image.height), focal_length) +
        2 * spacing;
    const Eigen::Vector3d axis = camera.world_from_camera_at(event.capture_s).col(2);
    const double azimuth = std::atan2(axis.y(), axis.x());
    const double elevation = -std::asin(std::clamp(axis.z(), -1.0, 1.0));
    const auto row_of = [&](double angle) {
      return static_cast<int>(std::lround(angle / spacing));
    };
    const double highest = std::min(std::abs(elevation) + reach, kTrackPi / 2);
    const double sideways = std::min(kTrackPi - spacing, reach / std::max(0.01, std::cos(highest)));
    for (int row = row_of(elevation - reach); row <= row_of(elevation + reach); ++row) {
      if (std::abs(row) * spacing > kTrackPi / 2) continue;
      for (int column = row_of(azimuth - sideways); column <= row_of(azimuth + sideways);
           ++column) {
        if (coarser_grids(row, column, octave) >= kLandmarkOctaves) continue;
        // In steps of the finest grid.
        const int finest = 1 << (kMostOctaves - octave);
        const std::pair<int, int> place{row * finest, (column % around + around) % around * finest};
        const double inverse = inverse_distance(config, place);
        const auto seen = camera.project_rolling(direction(column * spacing, row * spacing),
                                                 event.capture_s, inverse);
        if (!seen) continue;
        const int number = numbers.emplace(place, static_cast<int>(numbers.size())).first->second;
        const double u = seen->x() + noise(generator);
        tracks.push_back({event.frame, number, u, seen->y() + noise(generator), inverse});
      }
    }
  }
  return tracks;
}

void write_tracks(const Config& config, const std::vector<FrameEvent>& frames,
                  const CameraModel& camera, const std::filesystem::path& file) {
  OutputFile output(file);
  output.stream() << "frame,landmark,u_px,v_px,sigma_px\n";
  std::map<int, double> inverse_distances;
  for (const TrackedPoint& point : make_tracks(config, frames, camera)) {
    inverse_distances.emplace(point.landmark, point.inverse_distance);
    output.stream() << point.frame << ',' << point.landmark << ',' << point.u << ',' << point.v
                    << ',' << config.recording.pixel_sigma << '\n';
  }
  output.flush();
  if (!config.recording.landmark_distance) return;
  OutputFile landmarks(file.parent_path() / "truth_landmarks.csv");
  landmarks.stream() << "landmark,inverse_distance_per_m\n";
  for (const auto& [landmark, inverse] : inverse_distances) {
    landmarks.stream() << landmark << ',' << inverse << '\n';
  }
  landmarks.flush();
}

}  // namespace alidade::simulator

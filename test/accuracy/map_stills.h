#pragma once
// The bundle adjustment of a map (core/mapping/map_adjustment.h) on simulated stills: how accurate and how honest it is at each zoom,
// beside the same with less knowledge of the lens, and beside homographies from picture to picture (homography_chain.h).
//   scene      directions about the camera, each with a size; a picture sees those of 1.5 to 12 px, half of the time
//   pictures   5 levels of f, 1200 to 24,000 px, each about the middle of the wider one; half of their field from one to the next
//   lens       the virtual camera's curves (test/simulator/zoom_curve.h), optical centre off and wandering, f of each picture off
//              by the repeatability
//   known      zoom readings by a data sheet that is 1 % wrong, telemetry with noise and backlash, nothing of distortion and centre
// The forward model is the virtual camera's lens and Eigen's rotations: no code of core/.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace alidade::test {

struct MapStillsOptions {
  int runs = 1;
  std::uint64_t first_seed = 1;
  int directions = 200;       // drawn in each picture; others see them, too
  double nearest_px = 0.1;    // noise of the smallest features; of the largest three times as much
  double wrong_share = 0.02;  // of the observations
  double repeatability = 1e-3;  // sigma of log f
  double hold =
      1;  // what the lens keeps that rests off its curve: the distortion in the corner (1), or k (0)
  double angle_noise = 1e-4;  // rad
  double backlash = 2e-4;     // rad, to one side or the other
  double roll_wobble = 5e-5;  // rad
  double sheet_error = 0.01;  // of log f, smooth
  bool alone = false;         // only as a map is built, without the variants that know less
};

// Prints the tables; what is not as it should be, one line each.
[[nodiscard]] std::vector<std::string> run_map_stills(const MapStillsOptions& options,
                                                      std::ostream& out);

}  // namespace alidade::test

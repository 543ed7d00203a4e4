#pragma once
// ViewCoverage: what a session's frames have seen of the image and of the head's angles. For
// people, and to tell what motion is missing before a first calibration was tried. rad, s.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/model/angle.h"

namespace alidade {

// The range of telemetry's angles as they came, in the time of the session's frames. Pan is
// continuous over +-180 deg.
struct AngleRange {
  PanTilt<double> least;
  PanTilt<double> largest;
};

struct ViewCoverage {
  static constexpr std::size_t kColumns = 8;
  static constexpr std::size_t kRows = 6;
  static constexpr std::size_t kMostPath = 60;

  // Sightings of points in each cell of the image, row by row from the top-left.
  std::array<int, kColumns * kRows> points{};
  std::optional<AngleRange> range;    // empty: no telemetry came meanwhile
  double largest_rate = 0;            // rad/s, of pan and tilt together, over 0.2 s or more
  std::vector<PanTilt<double>> path;  // where the head was, thinned out to kMostPath
};

}  // namespace alidade

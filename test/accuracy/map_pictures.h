#pragma once
// A map built of pictures of the virtual camera (rendered_stills.h), and where random views look by it, against truth.
//   map        65 stills (or more) at five focal lengths from 1250 to 20,000 px; readings by a data sheet that is 1 % wrong, telemetry with noise
//              and backlash, nothing of distortion and centre
//   views      anywhere and at any zoom inside the map, three octaves of light, a fifth of each hidden
//   refused    views of another scene, of nothing, of fog
// Truth comes from test/simulator alone.

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/mapping/features.h"

namespace alidade::test {

struct MapPicturesOptions {
  std::uint64_t seed = 1;
  int views = 100;
  int columns = 5;  // of the map's views at each focal length: 5 * (3 columns - 2) pictures
  int features = FeatureOptions().max_features;  // of each picture of the map, at most
  int more = 0;  // of the 500 random views, that are pictures of the map, too
  std::filesystem::path cache = std::filesystem::temp_directory_path() / "alidade-stills";
  bool telemetry = true;      // of the map's pictures
  double angle_noise = 1e-4;  // rad
  double backlash = 2e-4;     // rad, to one side or the other
  double sheet_error = 0.01;  // of log f, smooth
};

// Prints the tables; what is not as it should be, one line each.
[[nodiscard]] std::vector<std::string> run_map_pictures(const MapPicturesOptions& options,
                                                        std::ostream& out);

}  // namespace alidade::test

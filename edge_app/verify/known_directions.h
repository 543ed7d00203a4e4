#pragma once
// Directions that are known from outside: surveyed points, a star, the horizon. A file names pixels
// of frames and where they look in the platform frame; this room compares them with what both modes
// say of those pixels.
//   r = (cos(elevation) (azimuth - seen azimuth), elevation - seen elevation)
//   C = stated sigma^2 + what the frame and the calibration claim
// All rows share the errors of the calibration; those of the frames count as one error, too, as
// OE mode's are alike: more rows then never make chance look improbable. With W = the inverse of
// C's blocks, r^T W r / trace(W C) is the square of the ratio, judged as in claim_check.h.
// rad. Pure, except for the reading; allocates.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/frame_orientation.h"
#include "edge_app/verify/pair_rows.h"

namespace alidade {

struct KnownDirection {
  std::int64_t frame = 0;
  Vector2<double> pixel = Vector2<double>::Zero();
  std::optional<double> azimuth;  // rad, positive to the right; none: a horizon
  double elevation = 0;           // rad, positive up
  double sigma = 0;               // rad, of each angle and of the pixel that was chosen
};

// Reads DIRECTIONS.csv (docs/commands.md). False: *error is one line that says what, where, and
// what would be right. width, height: px, of the pictures.
[[nodiscard]] bool read_known_directions(const std::string& path, int width, int height,
                                         std::vector<KnownDirection>* out, std::string* error);

// A known direction with its frame, by both modes; mode kNone: no orientation.
struct KnownSight {
  KnownDirection known;
  FrameOrientation by_telemetry;
  FrameOrientation by_landmarks;
};

struct KnownOffset {
  KnownDirection known;
  Vector2<double> off = Vector2<double>::Zero();    // rad; of a horizon only the second
  Vector2<double> sigma = Vector2<double>::Zero();  // rad, of `off`, by C
};

struct KnownResult {
  std::vector<KnownOffset> offsets;
  int numbers = 0;     // one or two a direction
  double freedom = 0;  // independent numbers behind the ratio
  double rms = 0;      // rad, of r's numbers
  double ratio = 0;
  double log_chance = 0;
  double share = 0;  // of C that frames and calibration claim; else the stated sigma decides
  // If there are numbers enough: the turn of all directions that fits best, about base's axes
  // (roll, pitch, yaw; rad), its sigma, and what remains.
  bool has_turn = false;
  Vector3<double> turn = Vector3<double>::Zero();
  Vector3<double> turn_sigma = Vector3<double>::Zero();
  double ratio_turned = 0;
  double log_chance_turned = 0;
};

// from: kTelemetry or kLandmarks. Sights without such an orientation are left out.
[[nodiscard]] KnownResult check_known(const std::vector<KnownSight>& sights, OrientationFrom from,
                                      const ParameterCovariance<double>& parameters);

}  // namespace alidade

#pragma once
// Directions that are known from outside: surveyed points, a star, the horizon. A table names
// pixels of frames and where they look; here they are compared with what each mode says of them.
//   r = the angle from the seen direction to the known one, to the right and up; of a horizon, up
//   C = stated sigma^2 + what the frame and the calibration claim
// The table's axes are those of the platform, but for a turn. The turn is stated, stated with a
// sigma, or estimated. With W = the inverse of C's blocks, r^T W r / trace(W C) is the square of
// the ratio, judged as in claim_check.h. It is not known whether the errors of all frames and zooms
// are alike, or independent from frame to frame and from zoom to zoom. Both cases are tried; the
// larger trace and the smaller freedom count. rad, px. Pure, but for the table. Allocates.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/frame_orientation.h"
#include "edge_app/verify/pair_rows.h"

namespace alidade {

struct KnownDirection {
  std::int64_t frame = 0;
  Vector2<double> pixel = Vector2<double>::Zero();  // px
  std::optional<double> azimuth;                    // rad, positive to the right; none: a horizon
  double elevation = 0;                             // rad, positive up
  double sigma = 0;  // rad, of each angle on the sphere, with that of the pixel that was chosen
};

inline constexpr int kMostKnownDirections = 1000;

// What a table may name.
struct KnownLimits {
  int width = 0;                     // px, of the pictures
  int height = 0;                    // likewise
  std::vector<std::int64_t> frames;  // of the recording, ascending
};

// Reads DIRECTIONS.csv (docs/manual/how-to/know-that-it-is-right.md). At most kMostKnownDirections.
// False: *error is one line that says what, where, and what would be right.
[[nodiscard]] bool read_known_directions(const std::string& path, const KnownLimits& limits,
                                         std::vector<KnownDirection>* out, std::string* error);

// How well the platform's turn against the table's axes is known: one standard deviation about 0.
struct TurnSigma {
  static constexpr double kFree = std::numeric_limits<double>::infinity();  // it is estimated
  double heading = 0;  // rad, about the vertical; 0: as stated
  double level = 0;    // rad, about both level axes; 0: as stated
};

// A known direction with its frame, by both modes; mode kNone: no orientation.
struct KnownSight {
  KnownDirection known;
  FrameOrientation by_telemetry;
  FrameOrientation by_landmarks;
};

// Known minus seen, after the turn. Sigmas by C. A horizon has only the second angle.
struct KnownOffset {
  KnownDirection known;
  Vector2<double> off = Vector2<double>::Zero();    // rad, to the right and up
  Vector2<double> sigma = Vector2<double>::Zero();  // rad
  // px, in the picture; to first order if the lens does not see so far.
  Vector2<double> off_px = Vector2<double>::Zero();
  double claimed_px = 0;  // the length of off_px that C claims
  double sigmas = 0;      // size of off by its covariance
};

struct KnownResult {
  std::vector<KnownOffset> offsets;  // in the table's order
  bool is_determined = false;        // else there are too few for the turn; only offsets holds
  int numbers = 0;                   // one or two a direction
  double freedom = 0;                // independent numbers behind the ratio
  double rms = 0;                    // rad, of the angles in offsets
  double rms_px = 0;                 // of the lengths of off_px
  double claimed_px = 0;             // rms_px as C claims it
  double ratio = 0;
  double log_chance = 0;  // natural; of a ratio at least as large, if the sigmas hold
  double share = 0;       // of what remains, claimed by frames and calibration; the rest is stated
  // The platform's roll, pitch and heading in the table's axes, rad. A sigma of 0: that angle is
  // taken as stated, or makes no difference.
  Vector3<double> turn = Vector3<double>::Zero();
  Vector3<double> turn_sigma = Vector3<double>::Zero();
};

// from: kTelemetry or kLandmarks. Sights without such an orientation are left out.
[[nodiscard]] KnownResult check_known(const std::vector<KnownSight>& sights, OrientationFrom from,
                                      const TurnSigma& turn_sigma);

}  // namespace alidade

#pragma once
// SceneReport: what localization by the scene map has done so far, for log, status and metrics.
// Plain values.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"

namespace alidade {

// The offset of telemetry's base in the map's base, to be added to telemetry's true angles.
struct BaseOffset {
  PanTilt<double> zero;                                  // rad
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2
  // rad, about the optical axis: the base has tilted. No correction of angles makes up for it.
  double roll = 0;
};

// What keeping the map up has done since the start (core/mapping/scene_map_upkeep.h).
struct UpkeepReport {
  std::int64_t pictures = 0;     // given to it
  std::int64_t updates = 0;      // of the file, one transaction each
  std::int64_t expected = 0;     // landmarks that should be found in them
  std::int64_t updated = 0;      // landmarks found and moved by it
  std::int64_t beyond_gate = 0;  // landmarks found, but too far off
  std::int64_t born = 0;
  std::int64_t died = 0;
  std::int64_t not_close = 0;  // landmarks not made: too far from all others
  std::int64_t hidden = 0;     // pictures in which too little was found to blame a landmark
  bool stopped = false;        // the file takes no more
};

// The part of the scene that a keyframe of the map shows.
struct SceneOutline {
  std::int64_t keyframe = 0;
  double focal_length = 0;              // px
  std::vector<Vector3<double>> border;  // unit vectors in the map's base, around the picture
};

struct SceneReport {
  struct Last {
    std::int64_t frame = 0;
    double finished_s = 0;              // s, host time
    double took_s = 0;                  // s
    const char* status = "";            // "ok", or why not: core/mapping/localization.h
    int matches = 0;                    // landmarks that support the result
    bool by_hint = false;               // the camera looks where the record said
    std::array<double, 2> sigma_rad{};  // pan, tilt; 0 if there is none
  };
  std::string name;  // of the map, for people
  std::int64_t keyframes = 0;
  std::int64_t landmarks = 0;
  bool ready = false;         // its index is built
  std::int64_t pictures = 0;  // looked at
  std::int64_t found = 0;
  std::int64_t found_by_hint = 0;  // of `found`
  std::int64_t not_in_map = 0;
  std::int64_t ambiguous = 0;
  std::int64_t unusable = 0;
  std::optional<Last> last;
  std::optional<BaseOffset> offset;  // from the last picture found
  std::int64_t movements = 0;  // of the base or telemetry's zero, each confirmed by two pictures
  std::optional<BaseOffset> moved;     // the latest of them
  bool uncorrected = false;            // the movement is reported only, and persists
  std::optional<UpkeepReport> upkeep;  // empty: the map is not kept up
};

}  // namespace alidade

#pragma once
// SceneReport: what localization by the scene map has done so far, for log, status and metrics. Plain values.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"

namespace alidade {

// How telemetry's base lies in the map's: what is to be added to telemetry's true angles.
struct BaseOffset {
  PanTilt<double> zero;                                  // rad
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2
  double roll =
      0;  // rad, about the optical axis: a base that has tilted; no correction of angles makes up for it
};

// What keeping the map up has done since the start (core/mapping/map_upkeep.h).
struct UpkeepReport {
  std::int64_t pictures = 0;     // that were shown to it
  std::int64_t updates = 0;      // of the file, one transaction each
  std::int64_t expected = 0;     // landmarks that should be found in them
  std::int64_t updated = 0;      // and were, and moved by it
  std::int64_t beyond_gate = 0;  // found, but too far off
  std::int64_t born = 0;
  std::int64_t died = 0;
  std::int64_t not_close = 0;  // not born: too far from all others
  std::int64_t hidden = 0;     // pictures in which too little was found to blame a landmark
  bool stopped = false;        // the file took nothing more
};

struct SceneReport {
  struct Last {
    std::int64_t frame = 0;
    double finished_s = 0;  // host time
    double took_s = 0;
    const char* status = "";            // "ok", or why not: core/mapping/localization.h
    int matches = 0;                    // landmarks that agree on it
    bool by_hint = false;               // it looks where the record said
    std::array<double, 2> sigma_rad{};  // of pan and tilt; 0 where there is none
  };
  std::string name;  // of the map, for people
  std::int64_t keyframes = 0;
  std::int64_t landmarks = 0;
  bool ready = false;         // its index is made
  std::int64_t pictures = 0;  // that were looked at
  std::int64_t found = 0;
  std::int64_t found_by_hint = 0;  // of these
  std::int64_t not_in_map = 0;
  std::int64_t ambiguous = 0;
  std::int64_t unusable = 0;
  std::optional<Last> last;
  std::optional<BaseOffset> offset;    // by the last one found
  std::int64_t movements = 0;          // of base or zero, said by two pictures
  std::optional<BaseOffset> moved;     // the last of them
  bool uncorrected = false;            // it is reported only, and lasts
  std::optional<UpkeepReport> upkeep;  // none: the map is not to be kept up
};

}  // namespace alidade

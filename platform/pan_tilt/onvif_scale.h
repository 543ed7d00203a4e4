#pragma once
// OnvifScale: converts the position values of an ONVIF device to angles.
//
// Rules, first match: (1) the scale that the user configured; (2) degrees, if the space says so, or
// the only declared one if the position names none; (3) an axis's range as the device declares it
// for the space, if it extends beyond -1..1: the user's angles are at its ends; without angles, pan
// and tilt are degrees if these ranges can be nothing else; (4) -1..1 with the user's angles at its
// ends, as in the standard. Errors: a position beyond its scale by more than 0.5 % of the scale's
// length; a space that is neither generic nor degrees, if rules 1 and 3 do not apply. No I/O.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

// The angles at the ends of a scale; between them the map is linear. at_low_rad > at_high_rad: the
// angle falls while the position grows.
struct OnvifRange {
  double at_low_rad = 0;   // at OnvifInterval::low; by rule 4 at -1
  double at_high_rad = 0;  // at OnvifInterval::high; by rule 4 at 1
};

// The user's configuration of an axis; of both axes or of none.
struct OnvifAxis {
  std::optional<OnvifRange> angles;    // nullopt: not configured
  std::optional<OnvifInterval> scale;  // device units at the ends of `angles`; nullopt: rules 2 - 4
};

class OnvifScale {
 public:
  OnvifScale(OnvifAxis pan, OnvifAxis tilt) : pan_(pan), tilt_(tilt) {}

  // True if the ranges that the device declares count: no scale is configured, and the space is not
  // degrees.
  [[nodiscard]] bool needs_ranges(const OnvifStatus& status) const;
  void set_ranges(std::vector<OnvifSpaceRange> ranges) { ranges_ = std::move(ranges); }

  enum class Outcome {
    kOk,
    kOutside,     // *error: this position is invalid, or its space is unknown
    kNeedsAngles  // *error: no position is valid until the user configures more
  };
  // kOk: *pan_rad and *tilt_rad are as the device counts, neither wrapped nor mapped (AxisMapping).
  // Otherwise they are unchanged, and *error is one line.
  [[nodiscard]] Outcome angles(const OnvifStatus& status, double* pan_rad, double* tilt_rad,
                               std::string* error) const;
  // One line on how a declared range is used for positions in the space of `status`. Empty: no
  // range is declared for this space, or it does not count, or it lies within -1..1 as in the
  // standard.
  [[nodiscard]] std::string note(const OnvifStatus& status) const;

 private:
  [[nodiscard]] const OnvifSpaceRange* declared(const std::string& space) const;

  OnvifAxis pan_;
  OnvifAxis tilt_;
  std::vector<OnvifSpaceRange> ranges_;
};

}  // namespace alidade

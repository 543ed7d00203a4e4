#pragma once
// OnvifScale: converts the position values of an ONVIF device to angles.
//
// Rules, first match: (1) the scale that the user configured; (2) degrees, if the space says so;
// (3) the range that the device declares for the space, if this range extends beyond -1..1, with
// the user's angles at its ends, or as degrees if it can be nothing else; (4) -1..1 with the user's
// angles at its ends, as in the standard. A position outside its scale is an error. No side
// effects.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

// Linear map of a device's scale; swapped values reverse the direction.
struct OnvifRange {
  double at_low_rad = 0;   // at the low end of the scale: -1
  double at_high_rad = 0;  // at the high end: 1
};

// The user's configuration of an axis.
struct OnvifAxis {
  std::optional<OnvifRange> angles;
  std::optional<OnvifInterval> scale;  // device units at the ends of `angles`; nullopt: rules 2 to
                                       // 4
};

class OnvifScale {
 public:
  OnvifScale(OnvifAxis pan, OnvifAxis tilt) : pan_(pan), tilt_(tilt) {}

  // True if a position in this space needs the ranges that the device declares.
  [[nodiscard]] bool needs_ranges(const OnvifStatus& status) const;
  void set_ranges(std::vector<OnvifSpaceRange> ranges) { ranges_ = std::move(ranges); }

  enum class Outcome {
    kOk,
    kOutside,     // *error: this position is invalid
    kNeedsAngles  // *error: no position is valid until the user configures more
  };
  [[nodiscard]] Outcome angles(const OnvifStatus& status, double* pan_rad, double* tilt_rad,
                               std::string* error) const;
  // One line on how a declared range is used for positions in the space of `status`. Empty: nothing
  // unusual.
  [[nodiscard]] std::string note(const OnvifStatus& status) const;

 private:
  [[nodiscard]] const OnvifSpaceRange* declared(const std::string& space) const;

  OnvifAxis pan_;
  OnvifAxis tilt_;
  std::vector<OnvifSpaceRange> ranges_;
};

}  // namespace alidade

#pragma once
// OnvifScale: from the numbers in which an ONVIF device tells its position to angles.
//
// In order: the scale that the user states; degrees, where the space says so; the range that the
// device declares for the space, where it reaches beyond -1..1, with the user's angles at its ends,
// or as degrees where it can be nothing else; -1..1 with the user's angles at its ends, as the
// standard has it. A position beyond its scale is none. Pure.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "platform/pan_tilt/onvif_messages.h"

namespace alidade {

// Linear map of a device's scale; swapped values turn the sign.
struct OnvifRange {
  double at_low_rad = 0;   // at the low end of the scale: at -1
  double at_high_rad = 0;  // at 1
};

// What the user states of an axis.
struct OnvifAxis {
  std::optional<OnvifRange> angles;
  std::optional<OnvifInterval> scale;  // what the device tells at their ends; none: see above
};

class OnvifScale {
 public:
  OnvifScale(OnvifAxis pan, OnvifAxis tilt) : pan_(pan), tilt_(tilt) {}

  // Whether what the device declares matters for a position in this space.
  [[nodiscard]] bool needs_ranges(const OnvifStatus& status) const;
  void set_ranges(std::vector<OnvifSpaceRange> ranges) { ranges_ = std::move(ranges); }

  enum class Outcome {
    kOk,
    kOutside,     // *error: this position is none
    kNeedsAngles  // *error: no position can be one until the user states more
  };
  [[nodiscard]] Outcome angles(const OnvifStatus& status, double* pan_rad, double* tilt_rad,
                               std::string* error) const;
  // What was made of a declared range for positions in the space of this one; empty: nothing
  // unusual.
  [[nodiscard]] std::string note(const OnvifStatus& status) const;

 private:
  [[nodiscard]] const OnvifSpaceRange* declared(const std::string& space) const;

  OnvifAxis pan_;
  OnvifAxis tilt_;
  std::vector<OnvifSpaceRange> ranges_;
};

}  // namespace alidade

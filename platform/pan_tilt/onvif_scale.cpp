#include "platform/pan_tilt/onvif_scale.h"

#include <cmath>
#include <string_view>
#include <utility>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr OnvifInterval kGenericScale{-1, 1};
constexpr OnvifInterval kDegreesScale{-360, 360};
constexpr double kRounding = 0.005;    // of a scale: positions often exceed its ends by this
                                       // fraction
constexpr double kLargestEnd = 1e6;    // a declared end beyond this is a placeholder
constexpr double kLeastPan_deg = 180;  // a pan range below this is not recognised as degrees
constexpr std::size_t kShownSpace = 120;
constexpr const char* kKeys =
    "give what it tells at two angles as pan_scale and tilt_scale, and these angles as "
    "pan_range_deg and tilt_range_deg";

std::string_view short_name(const std::string& space) {
  return std::string_view(space).substr(space.rfind('/') + 1);
}

bool is_generic(const std::string& space) {
  return space.empty() || short_name(space) == "PositionGenericSpace";
}

bool is_degrees(const std::string& space) {
  return short_name(space) == "SphericalPositionSpaceDegrees";
}

bool is_within(double value, const OnvifInterval& scale) {
  const double slack = kRounding * std::abs(scale.high - scale.low);
  return value >= std::fmin(scale.low, scale.high) - slack &&
         value <= std::fmax(scale.low, scale.high) + slack;
}

double mapped(double value, const OnvifInterval& scale, const OnvifRange& range) {
  return range.at_low_rad +
         (value - scale.low) / (scale.high - scale.low) * (range.at_high_rad - range.at_low_rad);
}

bool is_sound(const std::optional<OnvifInterval>& declared) {
  return declared && declared->low < declared->high && declared->low >= -kLargestEnd &&
         declared->high <= kLargestEnd;
}

// A range within -1..1 belongs to a generic space with end stops; the user's angles are still those
// at -1 and 1.
bool is_wide(const std::optional<OnvifInterval>& declared) {
  return is_sound(declared) &&
         (!is_within(declared->low, kGenericScale) || !is_within(declared->high, kGenericScale));
}

// A pan range that starts or ends in the middle of -1..1 may be a scale of its own.
bool is_half(const OnvifSpaceRange& range) {
  return is_sound(range.pan) && is_sound(range.tilt) && !is_wide(range.pan) &&
         !is_wide(range.tilt) && (range.pan->low == 0 || range.pan->high == 0);
}

double span(const std::optional<OnvifInterval>& declared) { return declared->high - declared->low; }

// Rules out steps and per cent: a pan range of half a turn to a turn, a tilt range of at most half
// a turn.
bool is_in_degrees(const OnvifSpaceRange& range) {
  return is_wide(range.pan) && is_wide(range.tilt) && span(range.pan) >= kLeastPan_deg &&
         span(range.pan) <= 360 && span(range.tilt) <= 180 &&
         is_within(range.pan->low, kDegreesScale) && is_within(range.pan->high, kDegreesScale) &&
         is_within(range.tilt->low, kDegreesScale) && is_within(range.tilt->high, kDegreesScale);
}

std::string text_of(const std::optional<OnvifInterval>& range) {
  return range ? shown(range->low) + ".." + shown(range->high) : std::string("nothing");
}

std::string text_of(const OnvifSpaceRange& range) {
  return "pan " + text_of(range.pan) + " and tilt " + text_of(range.tilt);
}

std::string as_scales(const OnvifSpaceRange& range) {
  const auto key = [](const char* name, const std::optional<OnvifInterval>& ends) {
    return std::string(name) + ": [" + shown(ends->low) + ", " + shown(ends->high) + "]";
  };
  return key("pan_scale", range.pan) + " and " + key("tilt_scale", range.tilt);
}

}  // namespace

bool OnvifScale::needs_ranges(const OnvifStatus& status) const {
  return !pan_.scale && !is_degrees(status.space);
}

// The range of this space. A generic space need not be named; nor need the only one.
const OnvifSpaceRange* OnvifScale::declared(const std::string& space) const {
  for (const OnvifSpaceRange& range : ranges_) {
    if (range.space == space || (is_generic(range.space) && is_generic(space))) return &range;
  }
  return space.empty() && ranges_.size() == 1 ? &ranges_.front() : nullptr;
}

OnvifScale::Outcome OnvifScale::angles(const OnvifStatus& status, double* pan_rad, double* tilt_rad,
                                       std::string* error) const {
  const OnvifSpaceRange* const range = needs_ranges(status) ? declared(status.space) : nullptr;
  const bool no_angles = !pan_.angles || !tilt_.angles;
  const bool space_of_degrees =
      !pan_.scale && is_degrees(range == nullptr ? status.space : range->space);
  const bool degrees = space_of_degrees || (no_angles && range != nullptr && is_in_degrees(*range));
  const bool any_wide = range != nullptr && (is_wide(range->pan) || is_wide(range->tilt));
  if (!pan_.scale && !degrees && !any_wide && !is_generic(status.space)) {
    *error =
        "the position is in the space '" + shown(status.space, kShownSpace) +
        "'; known are PositionGenericSpace and SphericalPositionSpaceDegrees; for another one, " +
        kKeys;
    return Outcome::kOutside;
  }
  const auto scale_of = [&](const OnvifAxis& axis,
                            const std::optional<OnvifInterval> OnvifSpaceRange::*which) {
    if (axis.scale) return *axis.scale;
    if (space_of_degrees) return kDegreesScale;
    const bool wide = range != nullptr && is_wide(range->*which);
    return wide ? *(range->*which) : degrees ? kDegreesScale : kGenericScale;
  };
  const OnvifInterval pan_scale = scale_of(pan_, &OnvifSpaceRange::pan);
  const OnvifInterval tilt_scale = scale_of(tilt_, &OnvifSpaceRange::tilt);
  if (!is_within(status.pan, pan_scale) || !is_within(status.tilt, tilt_scale)) {
    *error = "the position " + shown(status.pan) + ", " + shown(status.tilt) +
             " is outside its space, pan " + text_of(pan_scale) + " and tilt " +
             text_of(tilt_scale) +
             (pan_.scale ? "; are pan_scale and tilt_scale right?" : std::string("; ") + kKeys);
    return Outcome::kOutside;
  }
  if (degrees) {
    *pan_rad = status.pan * kRadPerDeg;
    *tilt_rad = status.tilt * kRadPerDeg;
    return Outcome::kOk;
  }
  if (no_angles) {
    constexpr const char* kAngles = " as pan_range_deg and tilt_range_deg";
    const bool half = range != nullptr && is_half(*range);
    *error = any_wide || half ? "the device tells pan and tilt as " + text_of(*range) +
                                    ", by its own declaration; give the angles at these ends," +
                                    kAngles + (half ? ", and " + as_scales(*range) : "")
                              : "the device tells pan and tilt as -1..1, not in degrees; give the "
                                "angles at -1 and 1," +
                                    std::string(kAngles) +
                                    " (often -180, 180 and -90, 90, whatever the head reaches)";
    return Outcome::kNeedsAngles;
  }
  *pan_rad = mapped(status.pan, pan_scale, *pan_.angles);
  *tilt_rad = mapped(status.tilt, tilt_scale, *tilt_.angles);
  return Outcome::kOk;
}

std::string OnvifScale::note(const OnvifStatus& status) const {
  const OnvifSpaceRange* const range = needs_ranges(status) ? declared(status.space) : nullptr;
  if (range == nullptr) return {};
  if (!is_sound(range->pan) || !is_sound(range->tilt)) {
    return "the device declares " + text_of(*range) +
           ", which is not a range; -1..1 is used for an axis without one";
  }
  if (is_half(*range)) {
    return "the device declares " + text_of(*range) +
           ", a part of -1..1: pan_range_deg and tilt_range_deg are taken as the angles at -1 and "
           "1; if they are the angles at the declared ends, add " +
           as_scales(*range);
  }
  if (!is_wide(range->pan) && !is_wide(range->tilt)) return {};
  return "the device declares " + text_of(*range) +
         (pan_.angles && tilt_.angles && !is_degrees(range->space)
              ? " in place of -1..1: pan_range_deg and tilt_range_deg are taken as the angles at "
                "these ends"
              : " in place of -1..1: taken as degrees, with zero at pan_zero_deg and "
                "tilt_zero_deg");
}

}  // namespace alidade

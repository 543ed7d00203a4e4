#pragma once
// How two calibrations of one camera differ, in the units of what is known of them.
//
//   d = b - a                                   by Parameter; of an axis its two numbers in a's tangent basis
//   chi_square = d^T (cov_a + cov_b)^-1 d       of the compared parameters, as if the two were independent
//
// Compared are focal length, radial distortion, line delay, both axes and the clock offset: scales and aspect rest on
// priors, which both calibrations share. Of two honest calibrations of one camera chi_square has the distribution of
// that many degrees of freedom (99.9 % of 8 lie below 26). px, rad, s. Pure; fixed memory.

#include <array>

#include "core/model/calibration.h"

namespace alidade {

inline constexpr std::array<Parameter, 8> kComparedParameters = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay,
    Parameter::kPanAxis0,    Parameter::kPanAxis1,         Parameter::kTiltAxis0,
    Parameter::kTiltAxis1,   Parameter::kClockOffset};  // the last one

// with_clock_offset: false where the frames' clock began anew between the two, so that the offsets have nothing in
// common: the chi-square is then one of 7 degrees of freedom.
[[nodiscard]] double difference_chi_square(const Calibration& a, const Calibration& b,
                                           bool with_clock_offset = true);

// Whether some compared parameter is known to less than `share` of the sigma that `before` has of it.
[[nodiscard]] bool is_sharper(const Calibration& after, const Calibration& before, double share);

}  // namespace alidade

#pragma once
// difference_chi_square(): the difference of two calibrations of one camera, relative to their
// covariances.
//   d = b - a                               by Parameter; axes in a's tangent basis
//   chi_square = d^T (cov_a + cov_b)^-1 d   as if the two were independent
// Compared are focal length, radial distortion, line delay, both axes and the clock offset. Scales
// and aspect rest on priors that both calibrations share, and are left out; so is the optical
// centre, which must be the same in both (centre_frame.h).
// If both covariances are right, chi_square is chi-square distributed with as many degrees of
// freedom as parameters are compared (with 8, 99.9 % lie below 26). px, rad, s. Pure; fixed memory.

#include <array>

#include "core/model/calibration.h"

namespace alidade {

static_assert(kDistortionCount == 1, "each term is compared; thresholds go by their number");
inline constexpr std::array<Parameter, 8> kComparedParameters = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay,
    Parameter::kPanAxis0,    Parameter::kPanAxis1,         Parameter::kTiltAxis0,
    Parameter::kTiltAxis1,   Parameter::kClockOffset};  // stays last

// with_clock_offset: false if the frames' clock restarted between the two calibrations, so that
// their clock offsets are unrelated. The chi-square then has 7 degrees of freedom. No compared
// parameter may be exact in both.
[[nodiscard]] double difference_chi_square(const Calibration& a, const Calibration& b,
                                           bool with_clock_offset = true);

// Whether the sigma of any compared parameter fell below `share` of its sigma in `before`.
[[nodiscard]] bool is_sharper(const Calibration& after, const Calibration& before, double share);

}  // namespace alidade

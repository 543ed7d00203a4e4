#pragma once
// plane.yaml of `alidade plane fit`: the ground under the camera.
//   format: 1
//   origin: {latitude_deg: 48.1, longitude_deg: 11.5, height_m: 520}
//                                            optional: x is east, y north of it (local_frame.h)
//   heading: {value: 0.7, sigma: 0.002}      rad, of the base's forward direction, clockwise from y
//   pitch, roll                              rad, of the base: forward lifted, right side lowered
//   x, y, height                             m, of the camera's optical centre
//   covariance: {names: [...], matrix: ...}  of these six; 0 for what the camera itself defines
//   quality: {...}                           optional; not read back
// Reading is strict, as for lens.yaml: every mistake gives an error in one line, `file:line: what;
// what would be right`. What was written is read back up to rounding.

#include <string>

#include "core/ground/plane_estimate.h"
#include "core/ground/plane_fit.h"

namespace alidade {

[[nodiscard]] bool parse_plane(const std::string& text, const std::string& name,
                               PlaneEstimate* estimate, std::string* error);
// The same for a file. A file that cannot be read is an error, too.
[[nodiscard]] bool load_plane(const std::string& path, PlaneEstimate* estimate, std::string* error);

// The base's forward direction must not point straight up or down (kLeastForward), as it then has
// no heading.
[[nodiscard]] std::string format_plane(const PlaneEstimate& estimate, const PlaneFit& fit);

}  // namespace alidade

#pragma once
// map.bin: what one calibration knows of the scene, in the folder of its calibration.yaml: the
// points adjusted with the calibration, and OE mode's map. The map's directions contain the
// calibration's errors, so a map is refused with any other calibration. Not for the real-time
// thread: allocates, reads and writes files. No shared state. Little-endian, packed. Sizes are for
// a calibration of 11 parameters_of(); in brackets for one of 13, which has an optical centre of
// its own:
//   offset 0   8 bytes  "ALIDMAP\n"
//          8   u32      format version, 3
//         12   u32      calibration_check() of the calibration it belongs to
//         16   u64      number of points n
//         24   u64      number of landmarks m
//         32   2 f64    offset of the map: pan, tilt, rad, base minus map
//         48   3 f64    its covariance: xx, xy, yy, rad^2
//         72   6 f64    covariance of pan's shear (angle, rate, acceleration): upper half, by rows
//        120   6 f64    the same of tilt's shear
//        168   f64      the tilt at which the shear holds, rad
//        176   22 f64   (26) sensitivity of the offset: rows pan, tilt; columns parameters_of()
//        352            (384) n times 60 bytes:
//                 i64     point's name in the tracks
//                 3 f64   d_b, unit direction in the base
//                 3 f64   cov_d: xx, xy, yy in tangent_basis(d_b), rad^2; calibration exact
//                 u32     observations
//              m times 464 bytes (480), see Landmark in core/realtime/oe_mode/landmark.h:
//                 u32     octave, 0 to 7
//                 3 f64   d, unit direction in the map's frame
//                 3 f64   covariance: xx, xy, yy, rad^2
//                 3 f64   shared covariance, likewise
//                 22 f32  (26) sensitivity, by rows
//                 4 f64   J_pixel_tangent, by rows
//                 256 u8  image, by rows
//                 u32     number of frames in which it was looked for
//                 u32     number of these in which it was found
//                 f32     mean square of the normalised residual
//        end   u32      CRC-32 of everything before
// A later version may change anything after the version number. Earlier versions, without
// sensitivities, are refused.

#include <cstdint>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/model/calibration.h"
#include "core/realtime/oe_mode/map_state.h"

namespace alidade {

struct MapContent {
  std::vector<CalibrationLandmark> points;
  MapState map;
};

// CRC-32 of the parameters' values, which calibration.yaml preserves bit by bit.
[[nodiscard]] std::uint32_t calibration_check(const Calibration& calibration);

// Pure. False: one line in *error. name: of the file, in errors. load_map() also refuses a file of
// more than 256 MiB.
[[nodiscard]] bool parse_map(const std::string& bytes, const std::string& name,
                             const Calibration& calibration, MapContent* content,
                             std::string* error);
[[nodiscard]] std::string format_map(const MapContent& content, const Calibration& calibration);

[[nodiscard]] bool load_map(const std::string& path, const Calibration& calibration,
                            MapContent* content, std::string* error);

// Atomic. Refuses what load_map() would refuse.
[[nodiscard]] bool save_map(const std::string& path, const MapContent& content,
                            const Calibration& calibration, std::string* error);

}  // namespace alidade

#pragma once
// map.bin: the landmarks of one calibration, beside its calibration.yaml. Little-endian, packed:
//   offset 0   8 bytes  "ALIDMAP\n"
//          8   u32      format version, 1
//         12   u32      calibration_check() of the calibration it belongs to
//         16   u64      number of landmarks n
//         24   n times 60 bytes:
//                 i64     landmark's name in the tracks
//                 3 f64   d_b, unit direction in the base
//                 3 f64   cov_d: xx, xy, yy in tangent_basis(d_b), rad^2; the calibration taken as exact
//                 u32     observations
//   24 + 60 n  u32      CRC-32 of everything before
// A later version may change anything after the version. A map is of use only with the calibration it
// was estimated with: its directions carry that one's errors, so another's is refused.
// Not for the real-time thread: allocates, reads and writes files. No shared state.

#include <cstdint>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/model/calibration.h"

namespace alidade {

// CRC-32 of the parameters' values, which calibration.yaml keeps bit by bit.
[[nodiscard]] std::uint32_t calibration_check(const Calibration& calibration);

// Pure: bytes in, landmarks or one line of error out. name stands for the file in errors.
[[nodiscard]] bool parse_landmarks(const std::string& bytes, const std::string& name,
                                   const Calibration& calibration,
                                   std::vector<CalibrationLandmark>* landmarks, std::string* error);
[[nodiscard]] std::string format_landmarks(const std::vector<CalibrationLandmark>& landmarks,
                                           const Calibration& calibration);

[[nodiscard]] bool load_landmarks(const std::string& path, const Calibration& calibration,
                                  std::vector<CalibrationLandmark>* landmarks, std::string* error);

// Atomic. Landmarks that load_landmarks() would refuse are refused here.
[[nodiscard]] bool save_landmarks(const std::string& path,
                                  const std::vector<CalibrationLandmark>& landmarks,
                                  const Calibration& calibration, std::string* error);

}  // namespace alidade

#pragma once
// calibration.yaml: one calibration as text that a person can read and correct.
//   format: 1
//   image: {width: 1920, height: 1080}
//   focal_length: {value: 32008, sigma: 24}          and so on for every parameter; units are the
//   model's: pan_axis: {value: [0, 0, 1], sigma: [0, 0]}      px, s, s/row, unit vectors (sigma:
//   rad in tangent_basis) zoom: 1234                                       optional covariance:
//   {names: [...], matrix: [[...], ...]} optional; wins over the sigmas, which must agree with it
// aspect may be absent (1), a sigma may be absent (0: exact). quality and landmarks are accepted
// and not kept: they belong to the run that wrote them. Everything else is strict: an unknown,
// missing or doubled key, a text for a number, a number that is not finite or betrays another unit,
// is one line `file:line: what is wrong; what would be right`. Reading back what was written gives
// the same bits. Not for the real-time thread: allocates and does input and output. Free of shared
// state.

#include <string>

#include "core/model/calibration.h"

namespace alidade {

// Pure: text in, calibration or error out. name stands for the file in errors.
[[nodiscard]] bool parse_calibration(const std::string& text, const std::string& name,
                                     Calibration* calibration, std::string* error);
[[nodiscard]] std::string format_calibration(const Calibration& calibration);

[[nodiscard]] bool load_calibration(const std::string& path, Calibration* calibration,
                                    std::string* error);

// Atomic: a reader, or a power cut, meets the old file or the new one, never half of one. A
// calibration that load_calibration() would refuse is refused here.
[[nodiscard]] bool save_calibration(const std::string& path, const Calibration& calibration,
                                    std::string* error);

}  // namespace alidade

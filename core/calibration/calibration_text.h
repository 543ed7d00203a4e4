#pragma once
// calibration.yaml: one calibration as text that a person can read and correct.
//   format: 1
//   image: {width: 1920, height: 1080}
//   focal_length: {value: 32008, sigma: 24}         so for every parameter, in the model's units
//   pan_axis: {value: [0, 0, 1], sigma: [0, 0]}     unit vector; sigma in rad, in tangent_basis
//   zoom: 1234                                      optional
//   covariance: {names: [...], matrix: [[...]]}     optional; the sigmas must agree with it
//   quality: {...}                                  optional: residuals, counts, priors, condition, advice
//   landmarks: map.bin                              optional: side file, beside this one
// aspect may be absent (1), a sigma may be absent (0, exact, unless the covariance says otherwise).
// quality and landmarks are accepted and not kept: they belong to the run that wrote them.
// All else is strict: an unknown, missing or doubled key, text for a number, a number that is not
// finite or betrays another unit is an error in one line, `file:line: what; what would be right`.
// Reading back what was written gives the same bits.
// Pure: no file is touched (edge_app/storage/calibration_file.h does). Allocates; no shared state.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/model/calibration.h"

namespace alidade {

// What a file tells people of the run that wrote it.
struct CalibrationNotes {
  std::optional<CalibrationQuality> quality;
  std::vector<std::string> excluded;  // CalibrationExclusions::describe()
  std::vector<std::pair<std::string, CalibrationPrior>> priors;  // that were used, by parameter
  std::string landmarks;                                         // side file's name; empty: none
};

// Text in, calibration or error out. name stands for the file in errors.
[[nodiscard]] bool parse_calibration(const std::string& text, const std::string& name,
                                     Calibration* calibration, std::string* error);
[[nodiscard]] std::string format_calibration(const Calibration& calibration,
                                             const CalibrationNotes& notes = {});

}  // namespace alidade

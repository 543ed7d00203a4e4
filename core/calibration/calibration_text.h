#pragma once
// calibration.yaml: one calibration as text that a person can read and correct.
//   format: 1
//   image: {width: 1920, height: 1080}
//   focal_length: {value: 32008, sigma: 24}         so for every parameter, in the model's units
//   pan_axis: {value: [0, 0, 1], sigma: [0, 0]}     unit vector; sigma in rad, in tangent_basis
//   centre_offset: {value: [0, 0], sigma: [0, 0]}   optional: px, of the optical centre from the image's middle
//   zoom: 1234                                      optional
//   covariance: {names: [...], matrix: [[...]]}     optional; the sigmas must agree with it
//   zoom_curve: {...}                               optional: calibrations at other readings, zoom_text.h
//   quality: {...}                                  optional: residuals, counts, priors, condition, advice
//   landmarks: map.bin                              optional: side file, beside this one
// aspect may be absent (1), centre_offset too (0, exact; it is no name of the covariance then, either), a
// sigma may be absent (0, exact, unless the covariance says otherwise).
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
#include "core/model/zoom_curve.h"

namespace alidade {

// What a file tells people of the run that wrote it.
struct CalibrationNotes {
  std::optional<CalibrationQuality> quality;
  std::vector<std::string> excluded;  // CalibrationExclusions::describe()
  std::vector<std::pair<std::string, CalibrationPrior>> priors;  // that were used, by parameter
  std::string landmarks;                                         // side file's name; empty: none
  ZoomCurve zoom_curve;                                          // empty: none
};

// Text in, calibration or error out. name stands for the file in errors.
// curve, if not null: the zoom curve, empty without one.
[[nodiscard]] bool parse_calibration(const std::string& text, const std::string& name,
                                     Calibration* calibration, std::string* error,
                                     ZoomCurve* curve = nullptr);
// What files name: all, but the optical centre only where it is anything but the image's middle exactly.
[[nodiscard]] std::vector<Parameter> parameters_of(const Calibration& calibration);
[[nodiscard]] std::string format_calibration(const Calibration& calibration,
                                             const CalibrationNotes& notes = {});

}  // namespace alidade

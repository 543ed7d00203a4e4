#pragma once
// calibration.yaml: one calibration as text for people to read and correct, in the model's units.
// Absent values: aspect is 1, centre_offset 0 and exact, a sigma 0 (exact) unless the covariance
// gives it. quality, landmarks, pupil_m, far_focal_length and holds_beyond_m belong to the run that
// wrote them: they are accepted and not kept.
// Reading is strict. An unknown, missing or doubled key, text for a number, a number that is not
// finite or looks like another unit is an error, `file:line: what; what would be right`.
// Reading back what was written gives the same bits (zoom_curve: see zoom_text.h). Pure: touches no
// file (edge_app/storage/calibration_file.h does). Allocates; no shared state.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"
#include "core/model/telemetry_error.h"

namespace alidade {

// What a file tells its readers about the run that wrote it.
struct CalibrationNotes {
  std::optional<CalibrationQuality> quality;
  std::vector<std::string> excluded;  // CalibrationExclusions::describe()
  std::vector<std::pair<std::string, CalibrationPrior>> priors;  // the ones used, by parameter
  std::string landmarks;                                         // side file's name; empty: none
  ZoomCurve zoom_curve;                                          // empty: none
  TelemetryError telemetry_error;                                // none by default
  Pupil pupil;                                       // as used; written if it is not the default
  std::optional<CalibrationPrior> far_focal_length;  // CalibrationResult::far_focal_length()
};

// Reads a text such as
//   format: 1
//   image: {width: 1920, height: 1080}
//   focal_length: {value: 32008, sigma: 24}         and likewise every parameter
//   pan_axis: {value: [0, 0, 1], sigma: [0, 0]}     unit vector; sigma in rad, in tangent_basis
//   centre_offset: {value: [0, 0], sigma: [0, 0]}   optional: px, optical centre - image's middle
//   centre_error: {sigma: [0.02, 0.03], correlation: 0}   optional: Calibration::centre_error, px
//   zoom: 1234                                      optional; needed with zoom_curve
//   covariance: {names: [...], matrix: [[...]]}     optional; must agree with the sigmas to 0.1 %
//   zoom_curve: {...}                               optional: other readings, zoom_text.h
//   pan_error, pan_play_rad ...: {...}              optional: telemetry_error_text.h
//   pupil_m: {value: [0, 0, 0.06], sigma: [...]}    optional: pupil.h; right, down, forward
//   far_focal_length: {value: 10660, sigma: 4}      optional: px, of far things
//   holds_beyond_m: 180                             optional: pupil.h
//   quality: {...}                                  optional: residuals, counts, priors, advice
//   landmarks: map.bin                              optional: file in the same folder
// False and one line in *error, in which `name` stands for the file; all else that is pointed to
// stays. curve, telemetry_error, if not null: empty if the file has none.
[[nodiscard]] bool parse_calibration(const std::string& text, const std::string& name,
                                     Calibration* calibration, std::string* error,
                                     ZoomCurve* curve = nullptr,
                                     TelemetryError* telemetry_error = nullptr);
// The parameters that format_calibration() names: all, except an optical centre that is exactly the
// image's middle.
[[nodiscard]] std::vector<Parameter> parameters_of(const Calibration& calibration);
[[nodiscard]] std::string format_calibration(const Calibration& calibration,
                                             const CalibrationNotes& notes = {});

}  // namespace alidade

#pragma once
// A summary of a calibration: as a table for people and as JSON for programs. The table has the
// units of data sheets (ms, us, mrad), and each value has only the digits that its sigma leaves
// meaningful (number_text.h). JSON has the names and units of calibration.yaml (s, rad, px), and
// all digits of a double. Pure; allocates.

#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// `options`, here and below: as the calibration used them.
struct SummaryRow {
  std::string parameter;  // by the name of Parameter; pan_axis, tilt_axis
  std::string value;
  std::string sigma;
  std::string unit;
  std::string prior;  // value and sigma in `unit`; "none": the parameter had no prior
};

// One row for each scalar parameter, and one for each axis. An axis's row has its unit vector and
// the sigmas of its two components in mrad. The optical centre has rows only if it was estimated.
std::vector<SummaryRow> summary_rows(const CalibrationResult& result,
                                     const CalibrationOptions& options);

// For which distances the calibration holds: "things farther than 180 m: ...". Empty: the focal
// length has no sigma, or the place of the pupil allows all distances.
std::string holds_beyond(const CalibrationResult& result, const CalibrationOptions& options);

// The focal length for far things: "10670 +- 5 px". Empty: no distance of the scene was stated.
std::string far_focal_length_text(const CalibrationResult& result);

// The assumption about the head's angles on which the sigma of the focal length rests: "a head
// exact to 0.01 degrees over 40 degrees". An error of the angles that changes only over the whole
// range of pan that was visited does not show in a recording. Empty: the user stated
// angle_accuracy_rad, the focal length has no sigma, or there is no trajectory.
std::string taken_for_granted(const CalibrationResult& result, const CalibrationOptions& options);

// The table in aligned columns, counts and residuals, errors of the telemetry, what was left out,
// the weakest direction, contradictions, the lines above that are not empty, and advice. Each line
// ends with a line feed.
std::string summary_text(const CalibrationResult& result, const CalibrationOptions& options);

// The errors found in the telemetry's angles, in mrad and degrees: a line for each axis with an
// error curve or play, without line feed.
std::vector<std::string> telemetry_error_lines(const TelemetryError& error);

// One line, with a line feed. files: kind and path of each file that was written.
std::string summary_json(const CalibrationResult& result, const CalibrationOptions& options,
                         const std::vector<std::pair<std::string, std::string>>& files);

// The priors in `options`, by the names of Parameter, in SI units and px: those that are stated,
// that of the optical centre if it was free, and always those of the axes. An axis's prior is of
// its two changes from nominal, rad; its value is 0.
std::vector<std::pair<std::string, CalibrationPrior>> stated_priors(
    const CalibrationOptions& options);

}  // namespace alidade

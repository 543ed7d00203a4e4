#pragma once
// A summary of a calibration: as a table for people and as JSON for programs. The table has the
// units of data sheets (ms, us, mrad), with as many digits as the sigma allows. JSON has the names,
// units and bits of calibration.yaml. Pure; allocates.

#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

struct SummaryRow {
  std::string parameter;
  std::string value;
  std::string sigma;
  std::string unit;
  std::string prior;
};

// One row for each parameter; an axis has one row.
std::vector<SummaryRow> summary_rows(const CalibrationResult& result,
                                     const CalibrationOptions& options);

// For which distances the calibration holds: "things farther than 180 m: ...". Empty: the focal
// length has no sigma.
std::string holds_beyond(const CalibrationResult& result, const CalibrationOptions& options);

// The focal length of far things, with a stated scene: "10670 +- 5 px". Else empty.
std::string far_focal_length_text(const CalibrationResult& result);

// The assumption about the head on which the sigma of f rests: a recording does not show an error
// that changes as slowly as the range of angles that was visited. Empty: the maker's claim is
// stated, or f has no such sigma.
std::string taken_for_granted(const CalibrationResult& result, const CalibrationOptions& options);

// The table in aligned columns, the verdict, what was left out, and advice. Each line ends with a
// line feed.
std::string summary_text(const CalibrationResult& result, const CalibrationOptions& options);

// The errors found in the telemetry's angles, a line for each axis that has one.
std::vector<std::string> telemetry_error_lines(const TelemetryError& error);

// One line. files: kind and path of each file that was written.
std::string summary_json(const CalibrationResult& result, const CalibrationOptions& options,
                         const std::vector<std::pair<std::string, std::string>>& files);

// The priors that were used, by the names of Parameter. Those of an axis are changes from nominal,
// rad.
std::vector<std::pair<std::string, CalibrationPrior>> stated_priors(
    const CalibrationOptions& options);

}  // namespace alidade

#pragma once
// The result of a calibration in short: as rows for a person, and as JSON for a program.
// People get the units of data sheets (ms, us, mrad), with as many digits as the sigma bears; JSON has the
// names, units and bits of calibration.yaml. Pure; allocates.

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

// One for each parameter; an axis is one.
std::vector<SummaryRow> summary_rows(const CalibrationResult& result,
                                     const CalibrationOptions& options);

// Aligned columns, the verdict, what was left out, and the advice. Lines end with a line feed.
std::string summary_text(const CalibrationResult& result, const CalibrationOptions& options);

// One line. files: what was written, by kind.
std::string summary_json(const CalibrationResult& result, const CalibrationOptions& options,
                         const std::vector<std::pair<std::string, std::string>>& files);

// The priors that were used, by the names of Parameter; an axis's are changes from nominal, in rad.
std::vector<std::pair<std::string, CalibrationPrior>> stated_priors(
    const CalibrationOptions& options);

}  // namespace alidade

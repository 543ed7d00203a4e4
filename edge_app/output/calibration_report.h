#pragma once
// report.html: a calibration to look at and to judge. One self-contained static page: inline style and
// SVG, no script, nothing loaded from elsewhere; light and dark as the reader's system is. What comes from
// files is escaped. Plots are thinned: a page for 100,000 observations stays below 2 MB. Pure; allocates.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {

struct CalibrationReportInput {
  std::string name;  // of the recording
  const CalibrationInput& input;
  const CalibrationOptions& options;
  const CalibrationResult& result;  // with a trajectory: kOk or kWeak
  std::vector<std::string> remarks;
  std::string version;                            // of the program
  std::string date;                               // and time of the report, with its zone
  std::optional<UntrackedFrames> untracked = {};  // why frames have no track, where that is known
};

std::string calibration_report(const CalibrationReportInput& report);

}  // namespace alidade

#pragma once
// report.html: a calibration for people to judge. One self-contained static page with inline style
// and SVG: no script, and nothing is loaded from elsewhere. It is light or dark as the reader's
// system. Text from files is escaped. Plots are thinned: a page for 100,000 observations stays
// below 2 MB. Pure; allocates.

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
  const CalibrationResult& result;  // must have a trajectory: kOk or kWeak
  std::vector<std::string> remarks;
  std::string version;                            // of the program
  std::string date;                               // date, time and zone of the report
  std::optional<UntrackedFrames> untracked = {};  // why frames have no track; empty: not known
};

std::string calibration_report(const CalibrationReportInput& report);

}  // namespace alidade

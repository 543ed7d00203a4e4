#pragma once
// report.html of `alidade calibrate-shutter`: line delay and lens to look at and to judge. One page as calibration_report.h's. Pure;
// allocates.

#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/pattern_data.h"

namespace alidade {

struct PatternReportInput {
  std::string name;     // of the video
  std::string pattern;  // as the person named it
  const PatternData& data;
  const PatternCalibration& calibration;  // kOk
  int images = 0;                         // read
  int found = 0;                          // with the pattern
  std::vector<std::string> remarks;
  std::string version;  // of the program
  std::string date;     // and time of the report, with its zone
};

[[nodiscard]] std::string pattern_report(const PatternReportInput& report);

}  // namespace alidade

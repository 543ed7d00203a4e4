#pragma once
// report.html of `alidade calibrate-shutter`: line delay and lens for people to judge. A page like
// that of calibration_report.h. Pure; allocates.

#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/pattern_data.h"

namespace alidade {

struct PatternReportInput {
  std::string name;     // of the video
  std::string pattern;  // as the user named it
  const PatternData& data;
  const PatternCalibration& calibration;  // must be kOk
  int images = 0;                         // number of images read
  int found = 0;                          // number of images with the pattern
  std::vector<std::string> remarks;
  std::string version;  // of the program
  std::string date;     // date, time and zone of the report
};

[[nodiscard]] std::string pattern_report(const PatternReportInput& report);

}  // namespace alidade

#pragma once
// A lens as a table for people: one row for each parameter, in the order of LensParameter.

#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"

namespace alidade {

struct LensTableRow {
  const char* name;
  std::string value;  // line delay in us/row; others in their own unit
  std::string sigma;
  const char* unit;  // empty: dimensionless
};

[[nodiscard]] std::vector<LensTableRow> lens_table(const PatternCalibration& calibration);

}  // namespace alidade

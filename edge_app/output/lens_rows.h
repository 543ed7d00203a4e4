#pragma once
// A lens as a table for people, one row a parameter in LensParameter's order.

#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"

namespace alidade {

struct LensRow {
  const char* name;
  std::string value;  // the line delay in us/row, all else in its own unit
  std::string sigma;
  const char* unit;  // empty: a plain number
};

[[nodiscard]] std::vector<LensRow> lens_rows(const PatternCalibration& calibration);

}  // namespace alidade

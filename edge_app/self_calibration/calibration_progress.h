#pragma once
// CalibrationProgress: how far SelfCalibration is with a first calibration, or with a fresh one
// that was asked for. Plain values, which another thread shows.

#include <string>

#include "core/calibration/calibration_goals.h"
#include "edge_app/self_calibration/view_coverage.h"

namespace alidade {

struct CalibrationProgress {
  int attempts = 0;      // with the data of this session and of the sessions that it replaced
  std::string refusal;   // the latest attempt's line in the log; empty: none was made
  ParameterGoals goals;  // by which the latest attempt was judged; before it without sigmas
  TravelLimits travel;   // of the camera as it is known so far
  double span_s = 0;     // of the data that are at hand
  ViewCoverage coverage;
};

}  // namespace alidade

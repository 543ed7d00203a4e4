#pragma once
// report.html of a calibration over several zooms: the curves of focal length, distortion and
// optical centre over the zoom reading with their sigmas, the dwells and the
// zoom's movements that made them, and how far each lies from the curve. The page is like that of
// calibration_report.h. Pure; allocates.

#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/zoom_fit.h"
#include "core/calibration/zoom_movement.h"

namespace alidade {

// A part of a recording at one zoom.
struct ZoomReportDwell {
  double zoom = 0;      // its reading, device units
  Calibration own;      // its own calibration, with its priors; only if it was calibrated
  std::string page;     // file name of its own report; empty: it has none
  std::string refusal;  // why it has no part in the curve; empty: it has one
};

struct ZoomReportMovement {
  double from = 0;  // readings, device units
  double to = 0;
  MovementObservation seen;  // only without a refusal
  std::string refusal;
};

struct ZoomReportInput {
  std::string name;  // of the recordings
  const ZoomFit& fit;
  std::vector<ZoomReportDwell> dwells;
  std::vector<ZoomReportMovement> movements;
  std::string version;  // of the program
  std::string date;     // date, time and zone of the report
};

// fit: of two readings or more.
std::string zoom_report(const ZoomReportInput& report);

}  // namespace alidade

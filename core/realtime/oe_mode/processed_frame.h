#pragma once
// ProcessedFrame: what process() found of a frame, for the upkeep of the map (maintain()). Plain values.

#include <cstdint>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

// What telemetry said of a frame's time.
enum class FrameTelemetry {
  kNone,
  kExtrapolated,  // from samples before
  kEnclosed       // by samples on both sides
};

// What a frame can do for the map.
enum class MapUse {
  kNone,     // nothing is sure
  kLost,     // landmarks do not hold, though some should be in view
  kNewView,  // no landmarks are in view: telemetry places new ones
  kHeld      // landmarks held
};

struct ProcessedFrame {
  std::uint32_t frame = 0;  // count of frames
  double time_s = 0;        // row 0, image clock
  MapUse use = MapUse::kNone;
  ImageView image;  // valid until maintain() has run
  FrameTelemetry telemetry = FrameTelemetry::kNone;
  double look_up_time_s = 0;  // telemetry clock, as telemetry was asked for it
  double look_up_sigma_s = 0;
  FrameMotion<double> motion;            // map's frame, about the middle row
  Matrix6 covariance = Matrix6::Zero();  // of motion, by the frame's own noise
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();                          // rad^2, of its angles, by the map's
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();  // of motion
  double inflation = 1;  // of the landmarks' covariances, by what their residuals show
};

}  // namespace alidade

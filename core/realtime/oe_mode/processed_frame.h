#pragma once
// ProcessedFrame: results of process() for the upkeep of the map in maintain(). Plain values.

#include <cstdint>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/lens/own_lens.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/moving_directions.h"
#include "core/realtime/oe_mode/offset_cells.h"

namespace alidade {

// Telemetry at a frame's time.
enum class FrameTelemetry {
  kNone,
  kExtrapolated,  // from earlier samples
  kEnclosed       // by samples on both sides
};

// Use of a frame for the map.
enum class MapUse {
  kNone,     // no reliable result
  kLost,     // landmarks do not hold, though some should be in view
  kNewView,  // no landmarks in view: telemetry places new ones
  kHeld      // landmarks held
};

struct ProcessedFrame {
  std::uint32_t frame = 0;  // frame count
  double time_s = 0;        // s, image clock, row 0
  MapUse use = MapUse::kNone;
  ImageView image;  // valid until maintain() returns
  FrameTelemetry telemetry = FrameTelemetry::kNone;
  double look_up_time_s = 0;  // s, telemetry clock; the time asked for
  double look_up_sigma_s = 0;
  AngleError error;            // of the telemetry looked up
  FrameMotion<double> motion;  // map's frame, about the middle row; with the solved zoom_rate
  Matrix6 covariance = Matrix6::Zero();  // of motion, from the frame's own noise
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();                          // rad^2, of its angles, from the map's
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();  // of motion
  double inflation = 1;  // of the landmarks' covariances, from their residuals
  OwnLens lens;
  bool solved = false;  // landmarks agreed with each other, with or without telemetry
  const MovingDirections* moving = nullptr;  // where no landmark is made; null: no such place
};

}  // namespace alidade

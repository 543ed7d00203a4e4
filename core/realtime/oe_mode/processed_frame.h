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

// The frame's lens, where that is not the map's (lens_track.h): how well log f (1) and its rate (1/s) are known beside the map's scale.
struct OwnLens {
  bool used = false;
  Matrix2<double> covariance = Matrix2<double>::Zero();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  int zoom = 0;  // of cells, see LandmarkMap

  // Of log f, t seconds after the middle row.
  [[nodiscard]] double variance(double t) const {
    return covariance(0, 0) + t * (2 * covariance(0, 1) + t * covariance(1, 1));
  }
  [[nodiscard]] Sensitivity<1> sensitivity_at(double t) const {
    return sensitivity.row(0) + t * sensitivity.row(1);
  }
};

struct ProcessedFrame {
  std::uint32_t frame = 0;  // count of frames
  double time_s = 0;        // row 0, image clock
  MapUse use = MapUse::kNone;
  ImageView image;  // valid until maintain() has run
  FrameTelemetry telemetry = FrameTelemetry::kNone;
  double look_up_time_s = 0;  // telemetry clock, as telemetry was asked for it
  double look_up_sigma_s = 0;
  FrameMotion<double> motion;  // map's frame, about the middle row; its zoom_rate is solved
  Matrix6 covariance = Matrix6::Zero();  // of motion, by the frame's own noise
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();                          // rad^2, of its angles, by the map's
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();  // of motion
  double inflation = 1;  // of the landmarks' covariances, by what their residuals show
  OwnLens lens;
};

}  // namespace alidade

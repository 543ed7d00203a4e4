#pragma once
// The record of a frame that has an orientation, as clients of the HTTP API may ask about it.

#include <cstdint>

#include "edge_app/record/frame_geometry.h"
#include "edge_app/record/orientation_record.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {

inline OrientationRecord record_of_frame(std::int64_t number) {
  Calibration calibration;
  calibration.camera = {1000, 1, {0.1}, 640, 480};
  calibration.line_delay = 30e-6;
  FrameOrientation frame;
  FUZZ_REQUIRE(make_frame_orientation(
      calibration, 1, OrientationMode::kOe, 10, {{0.1, -0.2}, {0.3, 0.4}, 0, {1, 2}},
      1e-10 * MotionCovariance::Identity(), Sensitivity<6>::Zero(), &frame));
  OrientationRecord out;
  out.frame = number;
  out.time_s = 1 + 0.04 * static_cast<double>(number);
  out.mode = RecordMode::kOe;
  out.camera = pack(calibration);
  out.orientation = OrientationRecord::Orientation{};
  out.orientation->geometry = pack(frame);
  return out;
}

}  // namespace alidade

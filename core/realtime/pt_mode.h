#pragma once
// PT mode: a frame's orientation from telemetry alone (PTCEE section V-C, 44 to 46). No pixel is
// touched.
//
//   measured angle and rate at  t0 + clock_offset + line_delay * height / 2,
//   divided by the scales, carried to row 0 at that rate.
//
// t0 is the capture time of row 0 on the image clock, clock_offset turns it into telemetry time. The
// paper looks up the time of row 0; the middle row is as far as possible from no row of the frame, so
// that an accelerating mount does the least harm. What harm remains (half the acceleration times the
// square of the time to the middle row, on average over the rows) is added to the covariance.
// No allocation, no state, no waiting.

#include "core/model/calibration.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {

// From a measured state of the time at which the middle row was exposed. False if a result is not
// finite; *out is then untouched.
[[nodiscard]] bool pt_orientation(const Calibration& calibration, double frame_time_s,
                                  const InterpolatedPanTilt& at_middle_row, FrameOrientation* out);

// frame_time_s is t0, one standard deviation of it frame_time_sigma_s. *out is written if
// has_result(status).
template <std::size_t Capacity>
[[nodiscard]] QueryStatus pt_orientation(const Calibration& calibration,
                                         const TelemetryBuffer<Capacity>& telemetry,
                                         double frame_time_s, double frame_time_sigma_s,
                                         FrameOrientation* out) {
  const double to_middle_row_s = calibration.line_delay * (0.5 * calibration.camera.height);
  InterpolatedPanTilt measured;
  const QueryStatus status = telemetry.query(
      frame_time_s + calibration.clock_offset + to_middle_row_s, frame_time_sigma_s, &measured);
  if (has_result(status) && !pt_orientation(calibration, frame_time_s, measured, out)) {
    return QueryStatus::kNotFinite;
  }
  return status;
}

}  // namespace alidade

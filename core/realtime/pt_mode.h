#pragma once
// PT mode: a frame's orientation from telemetry alone (PTCEE section V-C, 44 to 46). Uses no pixel.
//   measured angle and rate at  t0 + clock_offset + line_delay * height / 2,
//   divided by the scales, extrapolated to row 0 at that rate.
// t0 is the capture time of row 0 on the image clock; clock_offset converts it to telemetry time.
// The paper looks up row 0. The middle row is nearest to all rows, so there an acceleration of the
// mount makes the least error. The remaining error (half the acceleration times the squared time to
// the middle row, averaged over the rows) is added to the covariance.
// No allocation, no state, no waiting.

#include "core/model/calibration.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {

// at_middle_row: telemetry when the middle row was exposed. frame_time_s: t0. False if a result is
// not finite; *out is then unchanged.
[[nodiscard]] bool pt_orientation(const Calibration& calibration, double frame_time_s,
                                  const InterpolatedPanTilt& at_middle_row, FrameOrientation* out);

// frame_time_s is t0, frame_time_sigma_s (s) its standard deviation. The status is the query's, or
// kNotFinite if a result is not finite. *out is written if has_result(status).
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

#pragma once
// The numbers of a TelemetryReport that need more than counting: each axis, the samples while the
// head turned, and the age of the newest known angle. Meanings: telemetry_check.h. Pure; allocates.

#include <optional>
#include <vector>

#include "edge_app/check/spread.h"
#include "edge_app/check/telemetry_check.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// samples: at least one, all finite. Leaves top_rate unset.
[[nodiscard]] AxisReport measure_axis(const std::vector<PanTiltSample>& samples,
                                      double PanTiltSample::*angle);

// Sets `turning`, `stale` and how long repeats lasted. If eight new values or more came while the
// head turned, also sets change_hz and the top rates. samples: finite, in order of time. stale:
// find_stale_repeats(samples). Needs the axes' resolutions in *report.
void measure_turning(const std::vector<PanTiltSample>& samples, const std::vector<bool>& stale,
                     TelemetryReport* report);

// s: how old the newest known angle was just before each sample was delivered, as the real-time
// step knows it. delivered_s: one for each sample.
[[nodiscard]] std::optional<Spread> ages_of(const std::vector<PanTiltSample>& samples,
                                            const std::vector<double>& delivered_s,
                                            const TelemetryNeeds& needs);

}  // namespace alidade

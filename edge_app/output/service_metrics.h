#pragma once
// What `GET /metrics` answers: frames, losses, latency by stage, mode, telemetry's age, clock, calibration with its age
// and sigmas, clients; in the text format of metrics.h, with base units in the names. Any thread; allocates.

#include <string>

#include "edge_app/output/http_api.h"

namespace alidade {

[[nodiscard]] std::string service_metrics(const HttpApiSources& sources, const HttpCounters& http);

}  // namespace alidade

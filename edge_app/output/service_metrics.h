#pragma once
// The answer of `GET /metrics`: frames, losses, latency by stage, mode, age of telemetry, clock,
// calibration with its age and sigmas, clients. Text format of metrics.h, with base units in the
// names. Any thread; allocates.

#include <string>

#include "edge_app/output/http_api.h"

namespace alidade {

[[nodiscard]] std::string service_metrics(const HttpApiSources& sources, const HttpCounters& http);

}  // namespace alidade

#pragma once
// The answer of `GET /api/v1/status`: how the program, its links and its calibration do. Names and
// units: openapi.yaml. Any thread; allocates.

#include <nlohmann/json_fwd.hpp>

#include "edge_app/output/http_api.h"

namespace alidade {

[[nodiscard]] nlohmann::ordered_json service_status(const HttpApiSources& sources,
                                                    const HttpCounters& http);

// What the status says of recordings, and the answer of POST /api/v1/recording. sources.recorder
// must not be null.
[[nodiscard]] nlohmann::ordered_json recording_json(const HttpApiSources& sources);

}  // namespace alidade

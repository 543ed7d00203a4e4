#pragma once
// open_vapix(): polls an Axis camera for its pan, tilt and zoom:
//   GET /axis-cgi/com/ptz.cgi?query=position[&camera=N]
// over one kept HTTP connection with digest authentication (one 401 in total, not one a poll), or basic
// where that is permitted and nothing else offered (link_rules.h).
// Pace, stamps and threads: http_polling_source.h. kDisconnected: unreachable, timed out, HTTP
// status other than 200, an `Error:` answer, an answer that is not a position. kFailed: unusable
// URL; until the first sample also wrong user or password (401), later kDisconnected.

#include <memory>
#include <string>

#include "platform/pan_tilt/http_polling_source.h"

namespace alidade {

// VAPIX counts to the right and up.
struct VapixSourceOptions : HttpDeviceOptions {
  int camera = 0;  // video channel of a device with several, 1, 2, ...; 0: not named in the request
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_vapix(const VapixSourceOptions& options);

}  // namespace alidade

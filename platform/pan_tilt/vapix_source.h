#pragma once
// open_vapix(): polls an Axis camera for its pan, tilt and zoom:
//   GET /axis-cgi/com/ptz.cgi?query=position[&camera=N]
// over one persistent HTTP connection with digest authentication (one 401 in total, not one per
// poll), or basic where it is permitted and the only method offered (link_rules.h). Pace, stamps
// and threads: http_polling_source.h. kDisconnected and kFailed: as there. kDisconnected also after
// an answer of more than 4096 bytes, an HTTP status other than 200, an `Error:` answer, and an
// answer without a valid position. kFailed also for a URL with a path and, before the first sample,
// for a wrong user or password (401).

#include <memory>
#include <string>

#include "platform/pan_tilt/http_polling_source.h"

namespace alidade {

// VAPIX counts to the right and up.
struct VapixSourceOptions : HttpDeviceOptions {
  int camera = 0;  // video channel 1, 2, ... of a multi-channel device; 0: not in the request
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_vapix(const VapixSourceOptions& options);

}  // namespace alidade

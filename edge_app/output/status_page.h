#pragma once
// The status page of `alidade run`: page/ as one page at GET /, and the live image that it shows.
//
//   GET /                   needs no token: the page itself tells nothing about the camera. Its
//                           script asks for all that is shown, with the token
//   GET /api/v1/picture     a JPEG of a current frame, at most 480 px wide; its frame number is in
//                           X-Alidade-Frame
//   GET /api/v1/overlay     the landmarks of a frame (?frame=N, one of the last 16 shown), or of a
//                           current frame
//
// The policy allows the page's own style and script, nothing from elsewhere, and no framing.

#include <string>

#include "edge_app/output/http/http_server.h"
#include "edge_app/taps/image_tap.h"

namespace alidade {

// The build makes these from page/.
[[nodiscard]] std::string status_page_text();
extern const char* const kStatusPagePolicy;

// *tap is used until the server has stopped.
void add_status_page(HttpServer* server, ImageTap* tap);

// {"frame", "width", "height", "scale", "landmarks": [{"u", "v", "du", "dv", "used"}],
//  "points": [[u, v]]}, in px of the frame. A pixel of the JPEG is scale x scale px of the frame.
[[nodiscard]] std::string overlay_json(const LiveImage& image);

}  // namespace alidade

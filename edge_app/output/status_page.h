#pragma once
// The status page of `alidade run`: status_page.html at GET /, and the live image that it shows.
//
//   GET /                   open: it tells nothing of the camera; what it shows it asks for itself, with the token
//   GET /api/v1/image     a JPEG at most 480 px wide of a frame of now; its number is in X-Alidade-Frame
//   GET /api/v1/overlay     what was seen in that frame (?frame=N, one of the last 16 that were shown), or in one of now
//
// The page may run its own style and script, load nothing from elsewhere and be framed by nobody.

#include <string>

#include "edge_app/output/http/http_server.h"
#include "edge_app/taps/image_tap.h"

namespace alidade {

// Made from status_page.html when the program is built.
extern const char* const kStatusPage;
extern const char* const kStatusPagePolicy;

// Borrows *tap until the server has stopped.
void add_status_page(HttpServer* server, ImageTap* tap);

// {"frame", "width", "height", "scale", "landmarks": [{"u", "v", "du", "dv", "used"}], "points": [[u, v]]}, all px of
// the frame; a pixel of the JPEG is scale x scale of its pixels.
[[nodiscard]] std::string overlay_json(const LiveImage& image);

}  // namespace alidade

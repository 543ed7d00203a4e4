#pragma once
// The manual in a browser: GET /manual/ and the files below it, as the package has installed them.
// No token is needed. Only plain files of known kinds in that folder are served: a path with an
// empty or hidden part, as `..`, is refused, and so are a link that leads out of the folder and a
// file of more than 16 MiB. The pages come with a Content-Security-Policy that allows files of this
// server and nothing else.

#include <string>

#include "edge_app/output/http/http_server.h"

namespace alidade {

// share/doc/alidade/manual next to the folder of this program; empty if that is not known.
[[nodiscard]] std::string installed_manual();

// folder: as of installed_manual(). It is looked for at each request, as it may be installed later.
void add_manual_pages(HttpServer* server, const std::string& folder);

}  // namespace alidade

#pragma once
// The text of openapi.yaml, which describes the HTTP API; the build puts it into the program.

namespace alidade {

extern const char* const kOpenApi;

}  // namespace alidade

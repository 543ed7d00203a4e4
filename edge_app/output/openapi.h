#pragma once
// The text of openapi.yaml, which describes the HTTP API. The build embeds it in the program.

namespace alidade {

extern const char* const kOpenApi;

}  // namespace alidade

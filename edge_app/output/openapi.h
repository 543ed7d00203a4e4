#pragma once
// The text of openapi.yaml, which describes the HTTP API. The build embeds it in the program.

#include <string>

namespace alidade {

[[nodiscard]] const std::string& openapi_text();

}  // namespace alidade

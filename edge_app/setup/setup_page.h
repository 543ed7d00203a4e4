#pragma once
// The page of `alidade setup` and its Content-Security-Policy. The build makes them from page/.

#include <string>

namespace alidade {

[[nodiscard]] std::string setup_page_text();
extern const char* const kSetupPagePolicy;

}  // namespace alidade

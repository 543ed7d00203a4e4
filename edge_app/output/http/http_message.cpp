#include "edge_app/output/http/http_message.h"

#include <nlohmann/json.hpp>

namespace alidade {

std::optional<std::string> ServerRequest::parameter(const std::string& name) const {
  for (const auto& [key, value] : parameters) {
    if (key == name) return value;
  }
  return std::nullopt;
}

ServerResponse http_error(int status, const std::string& line) {
  ServerResponse response;
  response.status = status;
  response.body = nlohmann::json{{"error", line}}.dump(-1, ' ', true,
                                                       nlohmann::json::error_handler_t::replace) +
                  "\n";
  return response;
}

}  // namespace alidade

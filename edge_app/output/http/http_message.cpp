#include "edge_app/output/http/http_message.h"

#include <nlohmann/json.hpp>
#include <utility>

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
  // No JSON object here: its destructor allocates, and ends the program if it cannot.
  using Json = nlohmann::json;
  const std::string text = Json(line).dump(-1, ' ', true, Json::error_handler_t::replace);
  response.body = "{\"error\":" + text + "}\n";
  return response;
}

ServerResponse http_page(const char* type, std::string body, const char* policy) {
  ServerResponse response;
  response.type = type;
  response.body = std::move(body);
  response.headers = {{"Content-Security-Policy", policy},
                      {"Cache-Control", "no-cache"},
                      {"Referrer-Policy", "no-referrer"}};
  return response;
}

}  // namespace alidade

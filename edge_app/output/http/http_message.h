#pragma once
// Request and response of a handler. Nothing here knows a socket.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace alidade {

struct ServerRequest {
  std::string method;
  std::string path;  // decoded
  std::string body;
  std::vector<std::pair<std::string, std::string>> parameters;  // of the query, decoded
  // s since the request was complete; 0 at the first call of the handler.
  double waited_s = 0;

  [[nodiscard]] std::optional<std::string> parameter(const std::string& name) const;
};

// An endless answer: it lasts until its client or the server ends.
class HttpStream {
 public:
  virtual ~HttpStream() = default;
  // Appends to *piece what there is to send. Called on the network thread whenever the client has
  // taken everything before; must not wait. After a call that appends nothing, the next call comes
  // after HttpServer::wake(), at the latest after half a second.
  virtual void next(std::string* piece) = 0;
};

struct ServerResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::unique_ptr<HttpStream> stream;  // if set, sent in place of body
};

// {"error": line}
[[nodiscard]] ServerResponse http_error(int status, const std::string& line);

// For a browser, which is to ask again each time. policy: its Content-Security-Policy.
[[nodiscard]] ServerResponse http_page(const char* type, std::string body, const char* policy);

// Handlers run on several threads at the same time and must not wait. An empty result: there is no
// answer yet; the handler is called again 10 ms later.
using HttpHandler = std::function<std::optional<ServerResponse>(const ServerRequest&)>;

}  // namespace alidade

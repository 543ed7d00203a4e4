#pragma once
// What a handler is asked and what it answers; nothing here knows a socket.

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
  double waited_s =
      0;  // since the request was complete; more than 0 if the handler was asked before

  [[nodiscard]] std::optional<std::string> parameter(const std::string& name) const;
};

// An endless answer: it ends with its client or with the server.
class HttpStream {
 public:
  virtual ~HttpStream() = default;
  // Appends what there is to say. Called on the server's one network thread whenever the client has taken all that was
  // said before, and must not wait; where it appends nothing, it is asked again after HttpServer::wake(), and after
  // half a second at the latest.
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

// Handlers run on a few threads, several at a time, and must not wait. Nothing: there is no answer yet; the handler is
// asked again some milliseconds later.
using HttpHandler = std::function<std::optional<ServerResponse>(const ServerRequest&)>;

}  // namespace alidade

#include "edge_app/commands/setup.h"

#include <fmt/format.h>
#include <pwd.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <functional>
#include <future>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "edge_app/commands/camera_search.h"
#include "edge_app/commands/camera_setup.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/output/http/http_server.h"
#include "edge_app/output/json_query.h"
#include "edge_app/setup/setup_page.h"
#include "platform/system/random.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostBody = 16384;
constexpr std::size_t kMostKeys = 64;
constexpr double kSearch_s = 4;

std::string own_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "HOST";
}

std::string own_user() {
  const passwd* const entry = ::getpwuid(::getuid());
  return entry == nullptr ? "USER" : entry->pw_name;
}

std::string text_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return "";
  if (!found->is_string()) throw CommandError(kExitUsage, std::string(key) + ": expected a text");
  return found->get<std::string>();
}

std::vector<std::string> texts_in(const Json& object, const char* key) {
  std::vector<std::string> texts;
  const auto found = object.find(key);
  if (found == object.end()) return texts;
  bool whole = found->is_array() && found->size() <= kMostKeys;
  for (const Json& each : *found) {
    whole = whole && each.is_string();
    if (whole) texts.push_back(each.get<std::string>());
  }
  if (!whole) throw CommandError(kExitUsage, std::string(key) + ": expected a list of texts");
  return texts;
}

// Work that takes seconds, for one client at a time: handlers of the server must not wait.
class Desk {
 public:
  using Work = std::function<Json(const Json& body)>;

  // Empty while the work goes on.
  std::optional<ServerResponse> answer(const ServerRequest& request,
                                       const std::set<std::string>& keys, const Work& work) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (request.waited_s == 0) {
      if (at_work() && !is_over()) return http_error(409, "another search or trial is under way");
      Json body;
      std::string error;
      if (!parse_json_object(request.body, 3, keys, &body, &error)) return http_error(400, error);
      job_ = std::async(std::launch::async, [work, body] { return response_of(work, body); });
      return std::nullopt;
    }
    if (!at_work()) return http_error(409, "another client has taken over");
    return is_over() ? std::optional(job_.get()) : std::nullopt;
  }

 private:
  [[nodiscard]] bool at_work() const { return job_.valid(); }
  [[nodiscard]] bool is_over() const {
    return job_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  static ServerResponse response_of(const Work& work, const Json& body) {
    try {
      ServerResponse response;
      response.body = work(body).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
      return response;
    } catch (const CommandError& error) {
      return http_error(422, error.what());
    }
  }

  std::mutex mutex_;
  std::future<ServerResponse> job_;  // guarded by mutex_
};

CameraSearchOptions search_of(const Json& body) {
  CameraSearchOptions search;
  search.device = text_in(body, "device");
  search.login.user = text_in(body, "user");
  search.login.password = text_in(body, "password");
  // One that is named needs no search.
  search.network.duration_s = search.device.empty() ? kSearch_s : 0;
  return search;
}

Json search(const Json& body) { return json_of_findings(find_cameras(search_of(body))); }

Json write(const std::string& path, const Json& body) {
  const CameraSearchOptions search = search_of(body);
  CameraSetupOptions setup;
  setup.path = path;
  setup.device = search.device;
  setup.user = search.login.user;
  setup.password = search.login.password;
  setup.field_of_view = text_in(body, "field_of_view");
  setup.head = text_in(body, "head");
  setup.keys = texts_in(body, "keys");
  refuse_existing_files(setup);
  const CameraSetupResult result = set_up_camera(find_cameras(search), setup);
  spdlog::info("{}: written; next: alidade check -c {}", result.path, result.path);
  return {{"path", result.path},
          {"password_file", result.password_file.empty() ? Json() : Json(result.password_file)},
          {"remarks", result.remarks}};
}

ServerResponse setup_page() {
  return http_page("text/html; charset=utf-8", setup_page_text(), kSetupPagePolicy);
}

}  // namespace

int set_up_in_browser(const SetupOptions& options) {
  CameraSetupOptions setup;
  setup.path = options.write;
  refuse_existing_files(setup);
  HttpServerOptions http;
  http.port = options.port;
  http.token = random_hex(32);
  const auto desk = std::make_shared<Desk>();
  HttpServer server(http);
  server.get("/", HttpAccess::kOpen, [](const ServerRequest&) { return setup_page(); });
  server.post("/api/v1/setup/start", HttpAccess::kControl, kMostBody,
              [path = options.write](const ServerRequest&) {
                ServerResponse response;
                response.body = Json{{"path", path}}.dump() + "\n";
                return response;
              });
  server.post("/api/v1/setup/search", HttpAccess::kControl, kMostBody,
              [desk](const ServerRequest& request) {
                return desk->answer(request, {"device", "user", "password"}, search);
              });
  server.post("/api/v1/setup/write", HttpAccess::kControl, kMostBody,
              [desk, path = options.write](const ServerRequest& request) {
                return desk->answer(request,
                                    {"device", "user", "password", "field_of_view", "head", "keys"},
                                    [path](const Json& body) { return write(path, body); });
              });
  StopSignals signals;
  std::string error;
  if (!server.start(&error)) throw CommandError(kExitFailed, error);
  const std::string port = server.address().substr(server.address().rfind(':') + 1);
  fmt::print(
      "Open in a browser on this machine:\n  http://127.0.0.1:{0}/#{1}\n"
      "From another machine, run there first, and open the same address there:\n"
      "  ssh -L {0}:127.0.0.1:{0} {2}@{3}\nCtrl-C ends it.\n",
      port, http.token, own_user(), own_name());
  std::fflush(stdout);
  while (signals.wait(-1, std::numeric_limits<double>::infinity()) != StopSignals::Event::kSignal) {
  }
  server.stop();
  return kExitOk;
}

}  // namespace alidade

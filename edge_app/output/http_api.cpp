#include "edge_app/output/http_api.h"

#include <time.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "edge_app/output/record_format.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kClockEvery = 5;      // s, between two `clock` events
constexpr double kKeepAliveEvery = 3;  // s without anything else to say

ServerResponse json_response(const Json& body) {
  ServerResponse response;
  response.body = body.dump() + "\n";
  return response;
}

// Wall clock and host clock at one instant, as near as their reads lie together.
struct ClockPair {
  double monotonic_s = 0;
  double wall_s = 0;
  double bracket_s = std::numeric_limits<double>::infinity();
};

ClockPair read_clocks() {
  constexpr int kTries = 5;
  ClockPair best;
  for (int i = 0; i < kTries; ++i) {
    const double before_s = monotonic_now_s();
    timespec wall{};
    ::clock_gettime(CLOCK_REALTIME, &wall);
    const double after_s = monotonic_now_s();
    if (after_s - before_s >= best.bracket_s) continue;
    best = {(before_s + after_s) / 2,
            static_cast<double>(wall.tv_sec) + 1e-9 * static_cast<double>(wall.tv_nsec),
            after_s - before_s};
  }
  return best;
}

void add_clocks(Json* object) {
  const ClockPair clocks = read_clocks();
  (*object)["monotonic_s"] = clocks.monotonic_s;
  (*object)["wall_s"] = clocks.wall_s;
  (*object)["bracket_s"] = clocks.bracket_s;
}

std::string event(const char* name, const std::string& data) {
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

void follow(const HttpApiSources& sources, HttpStream& out) {
  LiveState::Reader reader(sources.live);
  Json hello{{"alidade", sources.version}, {"start", sources.live->start_id()}};
  add_clocks(&hello);
  if (!out.write(event("hello", hello.dump()))) return;
  double clock_due_s = 0;  // the first at once
  while (true) {
    if (monotonic_now_s() >= clock_due_s) {
      Json clock;
      add_clocks(&clock);
      if (!out.write(event("clock", clock.dump()))) return;
      clock_due_s = monotonic_now_s() + kClockEvery;
    }
    const LiveState::News news = reader.wait(kKeepAliveEvery);
    if (news.closed) return;
    std::string text;
    if (news.lost > 0) text += event("lost", Json{{"records", news.lost}}.dump());
    for (const LiveState::News::Line& line : news.lines)
      text += "id: " + std::to_string(line.id) + "\n" + event("orientation", *line.json);
    if (text.empty()) text = ": keep-alive\n\n";
    if (!out.write(text)) return;
  }
}

Json status(const HttpApiSources& sources) {
  Json out{{"alidade", sources.version},
           {"start", sources.live->start_id()},
           {"uptime_s", monotonic_now_s() - sources.live->started_s()},
           {"camera", sources.camera}};
  return out;
}

}  // namespace

void add_api_routes(HttpServer* server, const HttpApiSources& sources) {
  server->get("/healthz", HttpAccess::kOpen, [](const ServerRequest&) {
    ServerResponse response;
    response.type = "text/plain";
    response.body = "ok\n";
    return response;
  });
  server->get("/api/v1/orientation", HttpAccess::kToken, [sources](const ServerRequest&) {
    const auto newest = sources.live->newest();
    if (!newest) return http_error(404, "no record yet");
    ServerResponse response;
    response.body = json_line(*newest);
    return response;
  });
  server->get("/api/v1/stream", HttpAccess::kToken, [sources](const ServerRequest&) {
    ServerResponse response;
    response.type = "text/event-stream";
    response.headers.emplace_back("Cache-Control", "no-cache");
    response.stream = [sources](HttpStream& out) { follow(sources, out); };
    return response;
  });
  server->get("/api/v1/status", HttpAccess::kToken,
              [sources](const ServerRequest&) { return json_response(status(sources)); });
}

}  // namespace alidade

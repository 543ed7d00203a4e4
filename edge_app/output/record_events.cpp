#include "edge_app/output/record_events.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "edge_app/output/clock_pair.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kClockEveryS = 5;
constexpr double kKeepAliveEveryS = 3;

std::string event(const char* name, const std::string& data) {
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

}  // namespace

RecordEvents::RecordEvents(LiveState* live, const TargetLines* targets, std::string version)
    : live_(*live), targets_(targets), version_(std::move(version)), reader_(live) {}

void RecordEvents::next(std::string* piece) {
  if (!greeted_) {
    Json hello{{"alidade", version_}, {"start", live_.start_id()}};
    hello.update(clock_pair_json());
    *piece += event("hello", hello.dump());
    greeted_ = true;
  }
  const double now_s = monotonic_now_s();
  if (now_s >= clock_due_s_) {
    *piece += event("clock", clock_pair_json().dump());
    clock_due_s_ = now_s + kClockEveryS;
  }
  const LiveState::News news = reader_.take();
  if (news.lost > 0) *piece += event("lost", Json{{"records", news.lost}}.dump());
  for (const LiveState::News::Line& line : news.lines)
    *piece += "id: " + std::to_string(line.id) + "\n" + event("orientation", *line.json);
  if (targets_ != nullptr) {
    const TargetLines::Newest newest = targets_->newest();
    if (newest.id > targets_said_) *piece += event("targets", *newest.json);
    targets_said_ = newest.id;
  }
  if (piece->empty() && now_s >= said_s_ + kKeepAliveEveryS) *piece = ": keep-alive\n\n";
  if (!piece->empty()) said_s_ = now_s;
}

}  // namespace alidade

#include "alidade_ros/event_stream.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <utility>

namespace alidade_ros {

EventStream::EventStream(HttpClient* client, EventHandlers handlers)
    : client_(*client), handlers_(std::move(handlers)) {}

EventStream::~EventStream() { stop(); }

void EventStream::start() {
  thread_ = std::thread([this] { run(); });
}

void EventStream::stop() {
  client_.stop();
  if (thread_.joinable()) thread_.join();
}

EventStream::Counters EventStream::counters() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counters_;
}

void EventStream::run() {
  double wait_s = kFirstWaitS;
  while (!client_.stopped()) {
    record_came_ = false;
    in_sequence_ = false;
    SseParser parser([this](const SseEvent& event) { take(event); });
    bool too_large = false;
    std::string error = client_.stream("/api/v1/stream", [&](const char* bytes, std::size_t size) {
      too_large = !parser.feed(bytes, size);
      return !too_large;
    });
    if (client_.stopped()) return;
    if (too_large) error = client_.address().url + ": an event is too large";
    handlers_.on_disconnected(error);
    if (record_came_) wait_s = kFirstWaitS;
    client_.wait(wait_s);
    wait_s = std::min(2 * wait_s, kLongestWaitS);
  }
}

void EventStream::take(const SseEvent& event) {
  std::string error;
  if (event.type == "orientation") {
    take_record(event);
  } else if (event.type == "hello") {
    Hello hello;
    if (!parse_hello(event.data, &hello, &error)) return misunderstood(error);
    if (hello.start != start_) has_last_ = false;
    start_ = hello.start;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++counters_.connections;
    }
    handlers_.on_hello(hello);
  } else if (event.type == "clock") {
    ClockPair pair;
    if (!parse_clock_pair(event.data, &pair, &error)) return misunderstood(error);
    handlers_.on_clock(pair);
  } else if (event.type == "targets") {
    if (!handlers_.on_targets(event.data, &error)) return misunderstood(error);
  }
  // `lost` adds nothing to the numbers; other events come from a newer edge.
}

void EventStream::take_record(const SseEvent& event) {
  Record record;
  std::string error;
  char* end = nullptr;
  errno = 0;
  const std::uint64_t number = std::strtoull(event.id.c_str(), &end, 10);
  if (event.id.empty() || *end != '\0' || errno != 0) {
    return misunderstood("the edge's record has no number but \"" + event.id + "\"");
  }
  if (has_last_ && number <= last_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counters_.repeated;
    return;
  }
  const std::uint64_t left_out = in_sequence_ ? number - last_ - 1 : 0;
  last_ = number;
  has_last_ = in_sequence_ = record_came_ = true;
  const bool understood = parse_record(event.data, &record, &error);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    counters_.lost += left_out;
    if (understood) ++counters_.records;
  }
  if (!understood) return misunderstood(error);
  handlers_.on_record(record, number);
}

void EventStream::misunderstood(const std::string& error) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counters_.misunderstood;
  }
  handlers_.on_misunderstood(error);
}

}  // namespace alidade_ros

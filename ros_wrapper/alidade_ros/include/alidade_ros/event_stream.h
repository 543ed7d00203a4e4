#pragma once
// EventStream: the edge's records, each exactly once and in order, for as long as the node runs.
//
// One thread of its own reads GET /api/v1/stream. When the connection is lost, refused or silent it
// connects again, after waits that double from kFirstWaitS to kLongestWaitS and begin anew once a record
// has come. Records are told apart by the edge's `start` and their running number: a number that is not
// above the last one of the same start is a repetition and is left out; numbers left out within one
// connection were lost, and are counted. While the connection was down nothing counts as lost.
// A record that cannot be understood is reported and left out. The callbacks run on that thread.

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "alidade_ros/http_client.h"
#include "alidade_ros/record.h"
#include "alidade_ros/sse_parser.h"

namespace alidade_ros {

struct EventHandlers {
  std::function<void(const Hello&)> on_hello;                   // connected
  std::function<void(const ClockPair&)> on_clock;               // later pairs
  std::function<void(const Record&, std::uint64_t)> on_record;  // with its running number
  // What is tracked, as the edge's JSON. False: it is not understood, *error is one line.
  std::function<bool(const std::string& json, std::string* error)> on_targets;
  std::function<void(const std::string& error)> on_disconnected;   // one line
  std::function<void(const std::string& error)> on_misunderstood;  // one line
};

class EventStream {
 public:
  static constexpr double kFirstWaitS = 0.25;
  static constexpr double kLongestWaitS = 5;

  struct Counters {
    std::uint64_t connections = 0;
    std::uint64_t records = 0;
    std::uint64_t lost = 0;
    std::uint64_t repeated = 0;
    std::uint64_t misunderstood = 0;
  };

  // The client outlives this.
  EventStream(HttpClient* client, EventHandlers handlers);
  ~EventStream();
  EventStream(const EventStream&) = delete;
  EventStream& operator=(const EventStream&) = delete;

  void start();
  // Idempotent; stops the client, too. No callback runs after it returned.
  void stop();

  // Thread-safe.
  [[nodiscard]] Counters counters() const;

 private:
  void run();
  void take(const SseEvent& event);
  void take_record(const SseEvent& event);
  void misunderstood(const std::string& error);

  HttpClient& client_;
  EventHandlers handlers_;
  std::string start_;
  std::uint64_t last_ = 0;    // number of the newest record of start_
  bool has_last_ = false;     // there is one
  bool in_sequence_ = false;  // it came over this connection
  bool record_came_ = false;  // over this connection
  mutable std::mutex mutex_;
  Counters counters_;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace alidade_ros

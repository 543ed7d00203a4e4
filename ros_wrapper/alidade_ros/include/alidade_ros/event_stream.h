#pragma once
// EventStream: the edge's records, each exactly once and in order, as long as the node runs. A
// thread of its own reads GET /api/v1/stream. If the connection is lost, refused or silent, it
// reconnects after waits that double from kFirstWaitS to kLongestWaitS and start anew once a record
// has come. Records are identified by the edge's `start` and their running number. A number not
// above the last one of the same start is a repetition and is skipped. Numbers missing within one
// connection were lost and are counted; while the connection was down nothing counts as lost. A
// record that cannot be parsed is reported and skipped. The callbacks run on that thread.

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
  // The targets as the edge's JSON. False: it cannot be parsed, and *error is one line.
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

  // The client must outlive this object.
  EventStream(HttpClient* client, EventHandlers handlers);
  ~EventStream();
  EventStream(const EventStream&) = delete;
  EventStream& operator=(const EventStream&) = delete;

  void start();
  // Idempotent; also stops the client. No callback runs after it has returned.
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
  std::uint64_t last_ = 0;    // number of the latest record of start_
  bool has_last_ = false;     // there is one
  bool in_sequence_ = false;  // the latest record came over this connection
  bool record_came_ = false;  // a record came over this connection
  mutable std::mutex mutex_;
  Counters counters_;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace alidade_ros

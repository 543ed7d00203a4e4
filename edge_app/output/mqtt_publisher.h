#pragma once
// MqttPublisher: the newest state to an MQTT broker, on a niced thread of its own.
//   PREFIX/status        online; offline after the end, and as last will; retained
//   PREFIX/targets       targets after a frame of detections, as the event `targets` of the stream; retained
//   PREFIX/clock         host clock and wall clock at one instant, each ten seconds; retained
//   PREFIX/orientation   the newest record, at most orientation_rate_hz times a second
// Of each topic one message is under way, and the newest behind it waits; what comes meanwhile replaces that. So a broker that is slow, silent or
// gone costs no memory and no time of anybody else, and has the newest when it is back. Attempts to connect pause longer and longer. Targets that a
// broker retains of an earlier run are taken away at the first connection, as their times and identities mean nothing any more.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "edge_app/output/mqtt_connection.h"
#include "edge_app/output/mqtt_options.h"
#include "edge_app/record/orientation_record.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/niced_threads.h"
#include "platform/system/priority_mutex.h"

namespace alidade {

struct MqttCounters {
  bool connected = false;
  std::int64_t connections = 0;
  std::int64_t published = 0;  // messages that the broker has taken
  std::int64_t replaced = 0;   // states that newer ones took the place of, unsent
};

class MqttPublisher final : public RecordSink {
 public:
  explicit MqttPublisher(const MqttOptions& options);
  ~MqttPublisher() override;

  [[nodiscard]] bool start();  // false: there can be no thread
  // Says offline, if the broker is there and takes it within half a second.
  void stop();

  // Any thread; waits for nobody.
  void take_targets(std::shared_ptr<const std::string> json);
  // Output thread.
  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  [[nodiscard]] MqttCounters counters() const;

 private:
  enum Topic : std::size_t { kStatus, kTargets, kClock, kOrientation, kTopics };
  // The thread's.
  struct Slot {
    std::string topic;
    bool retain = true;
    std::shared_ptr<const std::string> newest;  // null: there is none
    bool waits = false;                         // to be sent
    std::optional<int> under_way;               // its id
  };

  void run();
  void keep_connected(MqttConnection* connection);
  void pause(double seconds);
  void wait_for(const MqttConnection* connection, double until_s);
  [[nodiscard]] double next_due_s() const;
  void gather(double now_s);
  void put(Topic topic, std::shared_ptr<const std::string> payload);
  [[nodiscard]] bool send(MqttConnection* connection);
  void say_farewell(MqttConnection* connection);
  void published(int id);
  void connection_begins();
  void tell_of_failure(const std::string& error, bool was_connected);

  const MqttOptions options_;
  const FileDescriptor news_;  // an eventfd
  NicedThreads thread_;
  std::atomic<bool> ends_{false};
  std::atomic<bool> wants_record_{false};

  mutable std::mutex targets_mutex_;  // held for moments, as those below
  std::shared_ptr<const std::string> offered_targets_;
  PriorityMutex record_mutex_;  // the output thread writes
  std::optional<OrientationRecord> offered_record_;

  std::array<Slot, kTopics> slots_;
  bool first_connection_ = true;
  double next_clock_s_ = 0;
  double next_record_s_ = 0;
  std::string told_;  // the failure that was logged last

  std::atomic<bool> connected_{false};
  std::atomic<std::int64_t> connections_{0};
  std::atomic<std::int64_t> published_{0};
  std::atomic<std::int64_t> replaced_{0};
};

}  // namespace alidade

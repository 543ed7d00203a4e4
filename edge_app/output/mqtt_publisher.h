#pragma once
// MqttPublisher: publishes the newest state to an MQTT broker, on a niced thread of its own.
//   PREFIX/status        online; offline at the end and as last will; retained
//   PREFIX/targets       targets after a frame of detections, like the event `targets`; retained
//   PREFIX/clock         host clock and wall clock (clock_pair.h), every ten seconds; retained
//   PREFIX/orientation   the newest record, at most orientation_rate_hz times a second
// For each topic at most one message is under way and one waits; a newer message replaces the one
// that waits. So a slow, silent or missing broker costs no memory, delays no other thread, and gets
// the newest state when it is back. The pauses between attempts to connect grow. The first
// connection deletes targets that the broker retains from an earlier run, as their times and
// identities have lost their meaning.

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
#include "platform/system/errand.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/niced_threads.h"
#include "platform/system/priority_mutex.h"

namespace alidade {

struct MqttCounters {
  bool connected = false;
  std::int64_t connections = 0;
  std::int64_t published = 0;  // messages that the broker has acknowledged
  std::int64_t replaced = 0;   // states that were replaced before they were sent
};

class MqttPublisher final : public RecordSink {
 public:
  explicit MqttPublisher(const MqttOptions& options);
  ~MqttPublisher() override;

  [[nodiscard]] bool start();  // false: the thread cannot be started
  // Publishes `offline`, if the broker accepts this within half a second, and ends the thread.
  void stop();

  // json: as the event `targets`. Any thread; does not wait.
  void take_targets(std::shared_ptr<const std::string> json);
  // For the output thread.
  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  [[nodiscard]] MqttCounters counters() const;

 private:
  enum Topic : std::size_t { kStatus, kTargets, kClock, kOrientation, kTopics };
  // Only for thread_.
  struct Slot {
    std::string topic;
    bool retain = true;
    std::shared_ptr<const std::string> newest;  // null: none yet
    bool waits = false;                         // newest must be sent
    std::optional<int> under_way;               // id of the message that is under way
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
  Errand errand_;              // of the connections
  NicedThreads thread_;
  std::atomic<bool> ends_{false};
  std::atomic<bool> wants_record_{false};

  mutable std::mutex targets_mutex_;  // held for moments only, as record_mutex_
  std::shared_ptr<const std::string> offered_targets_;
  PriorityMutex record_mutex_;  // the output thread goes first
  std::optional<OrientationRecord> offered_record_;

  std::array<Slot, kTopics> slots_;
  bool first_connection_ = true;
  double next_clock_s_ = 0;
  double next_record_s_ = 0;
  std::string told_;  // last failure that was logged

  std::atomic<bool> connected_{false};
  std::atomic<std::int64_t> connections_{0};
  std::atomic<std::int64_t> published_{0};
  std::atomic<std::int64_t> replaced_{0};
};

}  // namespace alidade

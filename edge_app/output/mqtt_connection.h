#pragma once
// MqttConnection: one connection to a broker, from the attempt to its end, by libmosquitto (MQTT 3.1.1). A new attempt is a new object, so that nothing
// of an old connection is sent over a new one: what a broker retains is never overwritten by what is older. For one thread, which waits for socket() to be
// ready, and calls step(). Looking up a name waits for the resolver; of a name with several addresses the first that does not refuse at once is taken.

#include <functional>
#include <memory>
#include <string>

#include "edge_app/output/mqtt_options.h"

struct mosquitto;

namespace alidade {

class MqttConnection {
 public:
  struct Message {
    std::string topic;
    std::string payload;
    bool retain = false;
  };

  // will: what the broker publishes if the connection ends without end(); null: nothing.
  MqttConnection(const MqttOptions& options, const Message* will);
  ~MqttConnection();
  MqttConnection(const MqttConnection&) = delete;
  MqttConnection& operator=(const MqttConnection&) = delete;

  // The broker has a message, or with QoS 0: it was sent.
  void set_on_published(std::function<void(int id)> on_published) {
    on_published_ = std::move(on_published);
  }

  // Begins to connect. False: it has failed.
  [[nodiscard]] bool begin();
  // Reads and writes what can be at once. False: the connection has failed, or has ended.
  [[nodiscard]] bool step();
  [[nodiscard]] bool is_connected() const { return connected_; }
  // What failed, in a line that names the broker and what would be right; no password.
  [[nodiscard]] const std::string& error() const { return error_; }

  [[nodiscard]] int socket() const;  // negative: none
  // For what to wait there, and how long at most: while TLS begins it does not say what it waits for.
  [[nodiscard]] bool wants_to_read() const { return half_since_s_ < 0; }
  [[nodiscard]] bool wants_to_write() const;
  [[nodiscard]] double patience_s() const;

  // Takes it up for sending. Connected only; false: it cannot be sent.
  [[nodiscard]] bool publish(const std::string& topic, const std::string& payload, bool retain,
                             int* id);
  // Says farewell: there is no will then.
  void end();

  // Of the files of TLS, before anything is tried: empty if all can be read.
  [[nodiscard]] static std::string files_error(const MqttOptions& options);
  // One connection without a will, for a check: empty if the broker takes it within options.timeout_s, else what failed.
  [[nodiscard]] static std::string try_once(const MqttOptions& options);

 private:
  enum class Incoming { kNothing, kAnswer, kHalfAnswer, kForeign, kUnknown };

  [[nodiscard]] bool set_up();
  [[nodiscard]] Incoming look_at_what_comes() const;
  [[nodiscard]] bool read_answers();
  [[nodiscard]] bool has_broken_off(bool* hung_up);
  [[nodiscard]] bool has_failed(int code);
  void fail(int error_number, int code);
  void fail_refused(int answer);
  [[nodiscard]] bool fail_with(const std::string& what);

  const MqttOptions options_;
  mosquitto* client_ = nullptr;
  bool connected_ = false;
  bool ending_ = false;
  double give_up_s_ = 0;      // monotonic
  double half_since_s_ = -1;  // so long an answer has not been whole; < 0: none is half
  std::string error_;
  std::string last_complaint_;  // of the library
  std::string set_up_error_;
  std::function<void(int)> on_published_ = [](int) {};

  struct Callbacks;
};

}  // namespace alidade

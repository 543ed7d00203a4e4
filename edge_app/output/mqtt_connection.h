#pragma once
// MqttConnection: one connection to a broker, from the attempt to its end, by libmosquitto (MQTT
// 3.1.1). Each attempt is a new object. So nothing of an old connection is sent over a new one, and
// no message that a broker retains is overwritten by an older one. For one thread, which waits
// until socket() is ready and then calls step(). If a name has several addresses, the first that
// does not refuse at once is taken. The library looks up names in a call that blocks, so the
// owner's Errand makes that call.

#include <functional>
#include <memory>
#include <string>

#include "edge_app/output/mqtt_options.h"
#include "platform/system/errand.h"

struct mosquitto;

namespace alidade {

class MqttConnection {
 public:
  struct Message {
    std::string topic;
    std::string payload;
    bool retain = false;
  };

  // will: what the broker publishes if the connection ends without end(); null: nothing. errand:
  // outlives the connection; the same for all of an owner, so that look-ups do not pile up.
  MqttConnection(const MqttOptions& options, const Message* will, Errand* errand);
  ~MqttConnection() = default;
  MqttConnection(const MqttConnection&) = delete;
  MqttConnection& operator=(const MqttConnection&) = delete;

  // Called when the broker has acknowledged a message; with QoS 0, when it was sent.
  void set_on_published(std::function<void(int id)> on_published) {
    on_published_ = std::move(on_published);
  }

  // Begins to connect. False: it failed, see error().
  [[nodiscard]] bool begin();
  // Reads and writes what is possible without waiting. False: the connection failed or ended.
  [[nodiscard]] bool step();
  [[nodiscard]] bool is_connected() const { return connected_; }
  // One line that names the broker, what failed and what would be right. Has no password.
  [[nodiscard]] const std::string& error() const { return error_; }

  // The descriptor to wait for: the socket, or, while the broker's name is looked up, a descriptor
  // that becomes readable at the end. Negative: none.
  [[nodiscard]] int socket() const;
  // What to wait for at socket(). patience_s(): how long to wait at most, s. During the TLS
  // handshake the library does not say what it waits for.
  [[nodiscard]] bool wants_to_read() const { return half_since_s_ < 0; }
  [[nodiscard]] bool wants_to_write() const;
  [[nodiscard]] double patience_s() const;

  // Queues a message. Only while connected. False: it cannot be sent.
  [[nodiscard]] bool publish(const std::string& topic, const std::string& payload, bool retain,
                             int* id);
  // Disconnects properly, so that the broker does not publish the will.
  void end();

  // Checks the TLS files before a connection is tried. One line on what is wrong; empty if all can
  // be read.
  [[nodiscard]] static std::string files_error(const MqttOptions& options);
  // For `check`: makes one connection without a will. Empty if the broker accepts it within
  // options.timeout_s, else what failed.
  [[nodiscard]] static std::string try_once(const MqttOptions& options);

 private:
  enum class Incoming { kNothing, kAnswer, kHalfAnswer, kForeign, kUnknown };

  struct Client;

  [[nodiscard]] mosquitto* handle() const;
  [[nodiscard]] bool set_up();
  [[nodiscard]] bool go_on_beginning();
  [[nodiscard]] Incoming look_at_what_comes() const;
  [[nodiscard]] bool read_answers();
  [[nodiscard]] bool has_broken_off(bool* hung_up);
  [[nodiscard]] bool has_failed(int code);
  void fail(int error_number, int code);
  void fail_refused(int answer);
  [[nodiscard]] bool fail_with(const std::string& what);

  const MqttOptions options_;
  Errand& errand_;
  std::shared_ptr<Client> client_;  // also the errand's, which may outlive the connection
  bool beginning_ = false;          // the errand uses client_
  bool connected_ = false;
  bool ending_ = false;
  double give_up_s_ = 0;      // monotonic time
  double half_since_s_ = -1;  // monotonic time since when an answer is incomplete; < 0: none is
  std::string error_;
  std::string set_up_error_;
  std::function<void(int)> on_published_ = [](int) {};

  struct Callbacks;
};

}  // namespace alidade
